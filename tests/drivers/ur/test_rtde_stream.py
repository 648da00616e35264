"""The state stream against a controller that behaves, and against anything else on its port."""

import contextlib
import socket
import struct
import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from drivers.clock import WallClock
from drivers.errors import ConnectError
from drivers.ur.rtde_codec import FrameBuffer, Kind, RtdeError, encode
from drivers.ur.rtde_stream import RTDE_PORT, RtdeStream
from sim_backend.loopback_ur.config import ControllerConfig
from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.rtde_session import RtdeSession
from tests.drivers.ur.loopback import free_host

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
Answer = Callable[[socket.socket], None]


@pytest.fixture
def serve() -> Iterator[Callable[[Answer], str]]:
    """Starts a server whose one connection a function handles; returns its address."""
    threads, listeners = [], []

    def start(answer: Answer) -> str:
        host = free_host()
        listener = socket.create_server((host, RTDE_PORT))
        listener.settimeout(5.0)
        listeners.append(listener)

        def run() -> None:
            connection, _ = listener.accept()
            connection.settimeout(5.0)
            with connection:
                answer(connection)

        threads.append(threading.Thread(target=run, daemon=True))
        threads[-1].start()
        return host

    yield start
    for thread in threads:
        thread.join(6.0)
    for listener in listeners:
        listener.close()


def until_hung_up(connection: socket.socket, reply: Callable[[bytes], bytes]) -> None:
    """Answer requests until the client goes away."""
    try:
        while data := connection.recv(65536):
            connection.sendall(reply(data))
    except OSError:
        return


def session() -> RtdeSession:
    return RtdeSession(Controller(ControllerConfig(version=(5, 11, 0, 0))), {})


def replacing(kind: Kind, payload: bytes) -> Answer:
    """A controller that behaves but for its reply to one kind of request."""
    real = session()

    def reply(data: bytes) -> bytes:
        messages = FrameBuffer().feed(real.feed(data))
        return b"".join(encode(m.kind, payload if m.kind == kind else m.payload) for m in messages)

    return lambda connection: until_hung_up(connection, reply)


def test_a_controller_that_behaves_gives_whole_samples(serve):
    controller = Controller(ControllerConfig())
    real = RtdeSession(controller, {})

    def answer(connection):
        while not real.started:
            connection.sendall(real.feed(connection.recv(65536)))
        connection.sendall(encode(Kind.TEXT, b"a message nobody asked for"))
        for _ in range(20):
            controller.step()
            connection.sendall(real.data_frame(controller.outputs()))
        connection.recv(1)

    stream = RtdeStream(serve(answer), CLOCK, 5.0)
    samples = []
    while len(samples) < 20:
        samples += stream.read(1.0)[0]
    stream.close()
    assert stream.rate_hz == 500.0
    assert np.allclose(np.diff([s["timestamp"] for s in samples]), 0.002, rtol=1e-3)
    assert samples[0]["tcp_offset"] == (0.0,) * 6


def test_a_controller_without_the_tcp_variable_is_read_without_it(serve):
    real = session()

    def reply(data):
        out = real.feed(data)
        if b"tcp_offset" in data:
            out = encode(Kind.SETUP_OUTPUTS, b"\x00" + b",".join([b"DOUBLE"] * 9 + [b"NOT_FOUND"]))
        return out

    stream = RtdeStream(serve(lambda c: until_hung_up(c, reply)), CLOCK, 5.0)
    stream.close()
    assert stream.rate_hz == 500.0


def test_an_old_controller_is_asked_for_125_hz(serve):
    stream = RtdeStream(
        serve(replacing(Kind.CONTROLLER_VERSION, struct.pack(">4I", 3, 15, 0, 0))), CLOCK, 5.0
    )
    stream.close()
    assert stream.rate_hz == 125.0


@pytest.mark.parametrize(
    "answer",
    [
        lambda c: None,
        lambda c: c.recv(100),
        lambda c: c.sendall(b"\x00\x01\x00garbage"),
        lambda c: c.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n"),
        replacing(Kind.PROTOCOL_VERSION, b"\x00"),
        replacing(Kind.CONTROLLER_VERSION, b"\x01\x02"),
        replacing(Kind.SETUP_OUTPUTS, b"\x01DOUBLE"),
        replacing(Kind.SETUP_OUTPUTS, b"\xff" * 40),
        replacing(Kind.START, b"\x00"),
    ],
)
def test_anything_else_is_a_connect_error_that_says_so(serve, answer):
    with pytest.raises(ConnectError, match="does not speak RTDE as expected"):
        RtdeStream(serve(answer), CLOCK, 2.0)


def test_silence_ends_with_the_timeout(serve):
    host = serve(lambda c: until_hung_up(c, lambda data: b""))
    start_s = CLOCK.now_s()
    with pytest.raises(ConnectError, match="no reply to request PROTOCOL_VERSION"):
        RtdeStream(host, CLOCK, 0.2)
    assert CLOCK.now_s() - start_s < 2.0


@pytest.mark.parametrize("after", [b"\x00\x00\x00", encode(Kind.DATA, b"\x01short")])
def test_garbage_or_an_end_after_the_start_is_a_typed_error(serve, after):
    real = session()

    def answer(connection):
        while not real.started:
            connection.sendall(real.feed(connection.recv(65536)))
        connection.sendall(after)

    host = serve(answer)
    with pytest.raises((RtdeError, ConnectionError)):
        stream = RtdeStream(host, CLOCK, 5.0)
        with contextlib.closing(stream):
            for _ in range(100):
                stream.read(0.05)
