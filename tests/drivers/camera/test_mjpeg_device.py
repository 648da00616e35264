"""An MJPEG stream as a device: its headers' stamps, and every way it can go wrong, in words."""

import base64

import numpy as np
import pytest

from drivers.camera.device import CameraLost, Mode
from drivers.camera.mjpeg_device import MjpegDevice
from drivers.clock import WallClock
from drivers.errors import ConnectError
from drivers.interfaces import Frame
from sim_backend.loopback_camera.publisher import encode_part
from tests.drivers.camera.streams import HEIGHT, WIDTH, ByteServer, noisy

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
HEAD = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n"
TIMEOUT_S = 0.3


def part(seq: int, t_s: float = 12.5) -> bytes:
    return encode_part(Frame(noisy(seq), t_s, 0.004, seq, "sim"), 95)


def device(url: str) -> MjpegDevice:
    return MjpegDevice(url, CLOCK, TIMEOUT_S)


def test_pictures_come_with_the_stamps_and_numbers_of_their_headers() -> None:
    with ByteServer(HEAD + part(3, 12.5) + part(4, 12.6)) as server:
        stream = device(server.url)
        assert stream.set_mode(Mode(), 2) == Mode(WIDTH, HEIGHT, None, "MJPG")
        grabs = [stream.grab(), stream.grab()]
        stream.release()
    assert [grab.sequence for grab in grabs] == [3, 4]
    assert [grab.stamp_s for grab in grabs] == [12.5, 12.6]
    assert [grab.exposure_s for grab in grabs] == [0.004, 0.004]
    assert all(grab.image is not None for grab in grabs)


def test_a_plain_server_without_stamps_or_lengths_is_read_too() -> None:
    body = part(1).partition(b"\r\n\r\n")[2]
    plain = b"--frame\r\nContent-Type: image/jpeg\r\n\r\n" + body
    with ByteServer(HEAD + plain + plain + b"--frame") as server:
        stream = device(server.url)
        grab = stream.grab()
        stream.release()
    assert grab.image is not None and grab.image.shape == (HEIGHT, WIDTH)
    assert (grab.stamp_s, grab.sequence, grab.exposure_s) == (None, None, None)


@pytest.mark.parametrize("text", [b"soon", b"nan", b"inf", b""])
def test_a_stamp_that_is_no_number_is_none(text: bytes) -> None:
    sent = part(1).replace(b"X-Timestamp: 12.500000000", b"X-Timestamp: " + text)
    with ByteServer(HEAD + sent) as server:
        stream = device(server.url)
        assert stream.grab().stamp_s is None
        stream.release()


def test_a_damaged_picture_is_marked_and_the_next_one_read() -> None:
    bad = part(1).replace(b"\xff\xd9\r\n", b"\x00\x00\r\n")
    with ByteServer(HEAD + bad + part(2)) as server:
        stream = device(server.url)
        assert stream.grab().image is None
        assert stream.grab().image is not None
        stream.release()


def test_silence_is_a_stall_after_the_timeout() -> None:
    with ByteServer(HEAD + part(1)) as server:
        stream = device(server.url)
        stream.grab()
        start_s = CLOCK.now_s()
        with pytest.raises(CameraLost, match="stalled"):
            stream.grab()
        assert 0.9 * TIMEOUT_S <= CLOCK.now_s() - start_s < 10 * TIMEOUT_S
        stream.release()


def test_a_server_that_hangs_up_is_lost() -> None:
    with ByteServer(HEAD + part(1), then_hang_up=True) as server:
        stream = device(server.url)
        stream.grab()
        with pytest.raises(CameraLost, match=r"closed the stream|broke"):
            stream.grab()
        stream.release()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"HTTP/1.0 404 Not Found\r\n\r\n", "404 Not Found"),
        (b"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\nhi", "no MJPEG stream but text/html"),
        (b"SSH-2.0-OpenSSH\r\n", "does not answer"),
        (b"", "does not answer"),
        (HEAD + part(1).replace(b"\xff\xd9\r\n", b"\0\0\r\n"), "not a readable JPEG"),
    ],
)
def test_what_is_no_such_stream_is_told_in_words(answer: bytes, words: str) -> None:
    with ByteServer(answer, then_hang_up=True) as server, pytest.raises(ConnectError, match=words):
        device(server.url).set_mode(Mode(), 2)


def test_nobody_there_is_told_in_words() -> None:
    with ByteServer(b"") as server:
        url = server.url
    with pytest.raises(ConnectError, match="does not answer"):
        device(url)
    with pytest.raises(ConnectError, match="is no address"):
        device("http://127.0.0.1:notaport/")


def test_a_name_and_password_in_the_address_are_sent() -> None:
    with ByteServer(HEAD + part(1)) as server:
        stream = device(server.url.replace("//", "//user:p%40ss@") + "?cam=1")
        stream.release()
        request = server.requests[0]
    assert b"Authorization: Basic " + base64.b64encode(b"user:p@ss") in request
    assert request.startswith(b"GET /x?cam=1 ")


def test_a_chunked_stream_is_read_too() -> None:
    head = HEAD.replace(b"HTTP/1.0", b"HTTP/1.1").replace(
        b"\r\n\r\n", b"\r\nTransfer-Encoding: chunked\r\n\r\n"
    )
    body = part(1) + part(2)
    pieces = [body[i : i + 97] for i in range(0, len(body), 97)]
    chunks = b"".join(b"%x\r\n%s\r\n" % (len(piece), piece) for piece in pieces)
    with ByteServer(head + chunks) as server:
        stream = device(server.url)
        assert [stream.grab().sequence, stream.grab().sequence] == [1, 2]
        stream.release()


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(
    "before",
    [b"", b"HTTP/1.0 200 OK\r\n", HEAD, HEAD + b"--frame\r\n", HEAD + part(1) + b"--frame\r\n"],
    ids=["nothing", "status", "head", "part", "picture"],
)
def test_garbage_is_always_a_typed_error(before: bytes, seed: int) -> None:
    garbage = np.random.default_rng(seed).integers(0, 256, 3000).astype(np.uint8).tobytes()
    with (
        ByteServer(before + garbage, then_hang_up=True) as server,
        pytest.raises((ConnectError, CameraLost)),
    ):
        read_without_end(device(server.url))


def read_without_end(stream: MjpegDevice) -> None:
    try:
        while True:
            stream.grab()
    finally:
        stream.release()
