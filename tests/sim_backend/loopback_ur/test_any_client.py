"""What any RTDE client may do, over real sockets, by a client that shares no code with it."""

import contextlib
import socket
import struct
import time
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sim_backend.loopback_ur.process import LoopbackProcess
from sim_backend.loopback_ur.server import CONTROL_PORT, DASHBOARD_PORT, RTDE_PORT, SCRIPT_PORT
from tests.drivers.ur.loopback import start_loopback
from tests.sim_backend.loopback_ur.plain_client import PlainClient

pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def loopback() -> Iterator[LoopbackProcess]:
    with start_loopback(unlock_after_s=0.0) as process:
        yield process


@pytest.fixture
def connect(loopback):
    """Makes clients that are gone after the test."""
    with contextlib.ExitStack() as stack:

        def make(protocol=2):
            return stack.enter_context(contextlib.closing(PlainClient(loopback.host, protocol)))

        yield make


@pytest.mark.parametrize("protocol", [1, 2])
def test_the_version_is_told_before_anything_else_was_agreed(connect, protocol):
    assert connect(protocol).version() == (5, 15, 0, 0)


def test_other_protocols_are_refused_and_the_connection_goes_on(connect):
    client = connect(1)
    for unknown in (0, 3, 65535):
        assert client.ask("V", struct.pack(">H", unknown)) == b"\x00"
    assert client.ask("V", struct.pack(">H", 2)) == b"\x01"


@pytest.mark.parametrize("protocol", [1, 2])
def test_data_follows_the_order_asked_for(connect, protocol):
    client = connect(protocol)
    types = client.outputs("robot_mode,actual_q,timestamp,output_bit_registers0_to_31")
    assert types == ["INT32", "VECTOR6D", "DOUBLE", "UINT32"]
    assert client.start()
    mode, *q, stamp, bits = client.data()
    assert (mode, bits) == (7, 0)
    assert q == pytest.approx([0.0, -np.pi / 2, -np.pi / 2, -np.pi / 2, np.pi / 2, 0.0])
    assert stamp > 1000.0


@pytest.mark.parametrize(("frequency_hz", "step_s"), [(500.0, 0.002), (125.0, 0.008), (10.0, 0.1)])
def test_protocol_2_chooses_the_frequency(connect, frequency_hz, step_s):
    client = connect()
    client.outputs("timestamp", frequency_hz)
    assert client.start()
    stamps = [client.data()[0] for _ in range(5)]
    assert np.diff(stamps) == pytest.approx(step_s, rel=1e-3)


def test_unknown_names_are_not_found_and_the_next_try_counts(connect):
    client = connect()
    assert client.outputs("timestamp,actual_nonsense") == ["DOUBLE", "NOT_FOUND"]
    assert not client.start()
    assert client.inputs("input_int_register_0,input_nonsense") == (0, ["INT32", "NOT_FOUND"])
    assert client.outputs("timestamp") == ["DOUBLE"]
    assert client.start()
    assert client.data()


def test_an_input_is_in_use_until_its_owner_hangs_up(connect):
    owner, other = connect(), connect()
    assert owner.inputs("input_double_register_30") == (1, ["DOUBLE"])
    assert other.inputs("input_double_register_30") == (0, ["IN_USE"])
    assert other.inputs("input_double_register_31") != (0, ["IN_USE"])
    owner.close()
    for _ in range(100):
        number, types = other.inputs("input_double_register_30")
        if number:
            break
        time.sleep(0.01)
    assert types == ["DOUBLE"]


def test_pause_ends_the_data_and_start_brings_it_back(connect):
    client = connect()
    client.outputs("timestamp")
    assert client.start()
    before_s = client.data()[0]
    assert client.pause()
    assert not client.waiting(0.1)
    assert client.start()
    assert client.data()[0] > before_s + 0.09


def test_each_client_has_its_own_recipe_and_rate(connect):
    clients = [connect(1), connect(2), connect(2)]
    for client, names, rate_hz in zip(
        clients,
        ("actual_q", "timestamp,runtime_state", "timestamp"),
        (None, 250.0, 50.0),
        strict=True,
    ):
        client.outputs(names, rate_hz)
        assert client.start()
    assert [len(client.data()) for client in clients] == [6, 2, 1]
    assert np.diff([clients[2].data()[0] for _ in range(3)]) == pytest.approx(0.02, rel=1e-3)


@pytest.mark.parametrize("protocol", [1, 2])
def test_a_protective_stop_is_reported_as_a_text_between_the_data(connect, loopback, protocol):
    client = connect(protocol)
    client.outputs("safety_mode")
    assert client.start()
    loopback.control.fault("protective_stop")
    while client.data()[0] != 3.0:
        pass
    client.data()
    assert [text.message for text in client.texts] == ["protective stop"]
    assert client.texts[0].level == 1  # an error
    with socket.create_connection((loopback.host, DASHBOARD_PORT), 5.0) as dashboard:
        lines = dashboard.makefile("rb")
        lines.readline()
        dashboard.sendall(b"unlock protective stop\n")
        assert b"releasing" in lines.readline()


def test_a_text_from_the_client_is_taken_and_not_answered(connect):
    client = connect()
    message, source = b"hello", b"test"
    client.send("M", bytes([len(message)]) + message + bytes([len(source)]) + source + b"\x03")
    client.send("M")
    assert client.version() == (5, 15, 0, 0)


def test_requests_may_arrive_in_pieces_and_in_one_piece(connect):
    client = connect()
    names = struct.pack(">d", 500.0) + b"timestamp"
    request = struct.pack(">H", len(names) + 3) + b"O" + names
    for at in range(len(request)):
        client.socket.sendall(request[at : at + 1])
        time.sleep(0.002)
    assert client.receive() == ("O", b"\x01DOUBLE")
    client.socket.sendall(b"\x00\x03v" * 3 + b"\x00\x03S")
    assert [client.receive()[0] for _ in range(4)] == ["v", "v", "v", "S"]


@pytest.mark.parametrize(
    "rubbish",
    [
        b"\x00\x00V",  # a size below the header's
        b"\x00\x03V",  # a protocol version of no bytes
        b"\x00\x04O\x00",  # half a frequency
        b"\x00\x03X",  # an unknown kind
        b"\x00\x05U\x07\x00",  # data for a recipe that was never set up
        b"GET / HTTP/1.1\r\n\r\n" + bytes(20000),
    ],
)
def test_what_is_not_the_protocol_costs_only_its_sender_the_connection(connect, rubbish):
    good, bad = connect(), connect()
    good.outputs("timestamp")
    assert good.start()
    with contextlib.suppress(OSError):
        bad.socket.sendall(rubbish)
    with contextlib.suppress(ConnectionResetError), pytest.raises(ConnectionError):
        bad.receive()
    stamps = [good.data()[0] for _ in range(20)]
    assert np.diff(stamps) == pytest.approx(0.002, rel=1e-3)


def test_a_package_that_never_ends_keeps_nobody_else_waiting(connect):
    good, slow = connect(), connect()
    slow.socket.sendall(b"\xff\xffO" + bytes(1000))
    assert good.version() == (5, 15, 0, 0)


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.sampled_from([RTDE_PORT, SCRIPT_PORT, DASHBOARD_PORT, CONTROL_PORT]),
    st.one_of(
        st.binary(max_size=300),
        st.text(max_size=80).map(lambda text: text.encode() + b"\n"),
        st.recursive(st.none() | st.floats() | st.text(max_size=5), st.lists, max_leaves=6).map(
            lambda value: (f'{{"get": "motion", "since_s": {value!r}}}\n').encode()
        ),
        st.just(b"[" * 30000 + b"\n"),
    ),
)
def test_garbage_on_any_port_neither_hangs_nor_ends_the_controller(loopback, port, garbage):
    with socket.create_connection((loopback.host, port), 5.0) as rude, contextlib.suppress(OSError):
        rude.sendall(garbage)
    with contextlib.closing(PlainClient(loopback.host)) as polite:
        assert polite.version() == (5, 15, 0, 0)


def test_more_clients_than_it_has_room_for_are_turned_away(loopback):
    with contextlib.ExitStack() as stack:
        for _ in range(130):
            connection = socket.create_connection((loopback.host, RTDE_PORT), 5.0)
            stack.enter_context(contextlib.closing(connection))
        connection.settimeout(5.0)
        with contextlib.suppress(ConnectionResetError):
            assert connection.recv(1) == b""
    with contextlib.closing(PlainClient(loopback.host)) as client:
        assert client.version() == (5, 15, 0, 0)
