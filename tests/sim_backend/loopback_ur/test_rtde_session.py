"""The RTDE server on bytes: both protocol versions, ownership of inputs, and fuzz."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.ur.rtde_codec import FrameBuffer, Kind, RtdeError, encode
from sim_backend.loopback_ur.config import ControllerConfig
from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.rtde_session import RtdeSession

KINDS = st.sampled_from([*[int(kind) for kind in Kind], 0, 255])


class Client:
    """A session, spoken to in messages."""

    def __init__(self, controller=None, owners=None, version=2):
        self.controller = controller or Controller(ControllerConfig())
        self.session = RtdeSession(self.controller, {} if owners is None else owners)
        if version == 2:
            assert self.ask(Kind.PROTOCOL_VERSION, b"\x00\x02") == b"\x01"

    def ask(self, kind, payload=b""):
        replies = FrameBuffer().feed(self.session.feed(encode(kind, payload)))
        assert [reply.kind for reply in replies] == [kind]
        return replies[0].payload

    def data(self):
        frames = FrameBuffer().feed(self.session.data_frame(self.controller.outputs()))
        return frames[0].payload if frames else None


def outputs(rate_hz, names):
    return struct.pack(">d", rate_hz) + names


def test_the_controller_tells_its_version():
    assert struct.unpack(">4I", Client().ask(Kind.CONTROLLER_VERSION)) == (5, 15, 0, 0)


def test_unknown_protocol_versions_are_refused():
    assert Client().ask(Kind.PROTOCOL_VERSION, b"\x00\x03") == b"\x00"


def test_protocol_2_has_a_frequency_and_recipe_ids():
    client = Client()
    assert client.ask(Kind.SETUP_OUTPUTS, outputs(500.0, b"timestamp,runtime_state,")) == (
        b"\x01DOUBLE,UINT32"
    )
    assert client.data() is None  # nothing before the start
    assert client.ask(Kind.START) == b"\x01"
    assert client.data() == b"\x01" + struct.pack(">dI", 1000.0, 1)
    assert client.ask(Kind.PAUSE) == b"\x01"
    assert client.data() is None


def test_protocol_1_has_neither():
    client = Client(version=1)
    assert client.ask(Kind.SETUP_OUTPUTS, b"timestamp,robot_mode") == b"DOUBLE,INT32"
    assert client.ask(Kind.START) == b"\x01"
    assert client.data() == struct.pack(">di", 1000.0, 7)


def test_a_lower_frequency_sends_every_nth_cycle():
    client = Client()
    client.ask(Kind.SETUP_OUTPUTS, outputs(125.0, b"timestamp"))
    client.ask(Kind.START)
    sent = 0
    for _ in range(40):
        client.controller.step()
        sent += client.data() is not None
    assert sent == 10


def test_an_unknown_output_is_not_found_and_cannot_be_started():
    client = Client()
    reply = client.ask(Kind.SETUP_OUTPUTS, outputs(500.0, b"timestamp,nonsense"))
    assert reply == b"\x00DOUBLE,NOT_FOUND"
    assert client.ask(Kind.START) == b"\x00"


def of_version(*version):
    return Client(Controller(ControllerConfig(version=version)))


def test_a_cb3_reports_at_125_hz_and_no_faster():
    client = of_version(3, 15, 8, 0)
    assert client.ask(Kind.SETUP_OUTPUTS, outputs(500.0, b"timestamp"))[:1] == b"\x00"
    assert client.ask(Kind.SETUP_OUTPUTS, outputs(125.0, b"timestamp"))[:1] == b"\x01"
    client.ask(Kind.START)
    stamps = []
    for _ in range(40):
        client.controller.step()
        payload = client.data()
        stamps += [] if payload is None else [struct.unpack(">d", payload[1:])[0]]
    assert len(stamps) == 10
    assert stamps[1] - stamps[0] == pytest.approx(0.008, rel=1e-3)


@pytest.mark.parametrize(
    ("version", "known"),
    [((3, 7, 0, 0), False), ((3, 12, 0, 0), True), ((5, 5, 0, 0), False), ((5, 5, 1, 0), True)],
)
def test_what_came_with_a_later_version_is_not_found(version, known):
    reply = of_version(*version).ask(Kind.SETUP_OUTPUTS, outputs(125.0, b"tcp_offset"))
    assert reply == (b"\x01VECTOR6D" if known else b"\x00NOT_FOUND")


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, 501.0, float("nan"), float("inf")])
def test_an_impossible_frequency_is_refused(rate_hz):
    assert Client().ask(Kind.SETUP_OUTPUTS, outputs(rate_hz, b"timestamp"))[:1] == b"\x00"


def test_inputs_are_numbered_per_connection_and_reach_the_registers():
    client = Client()
    assert client.ask(Kind.SETUP_INPUTS, b"input_int_register_0,input_double_register_3,") == (
        b"\x01INT32,DOUBLE"
    )
    assert client.ask(Kind.SETUP_INPUTS, b"input_int_register_1") == b"\x02INT32"
    client.session.feed(encode(Kind.DATA, b"\x01" + struct.pack(">id", 10, 2.5)))
    client.session.feed(encode(Kind.DATA, b"\x02" + struct.pack(">i", -7)))
    controller = client.controller
    assert (controller.input_int(0), controller.input_double(3)) == (10, 2.5)
    assert controller.input_int(1) == -7


def test_an_input_belongs_to_one_connection_until_it_closes():
    owners = {}
    first = Client(owners=owners)
    second = Client(first.controller, owners)
    first.ask(Kind.SETUP_INPUTS, b"input_int_register_0")
    assert second.ask(Kind.SETUP_INPUTS, b"input_int_register_0") == b"\x00IN_USE"
    assert second.ask(Kind.SETUP_INPUTS, b"input_int_register_99") == b"\x00NOT_FOUND"
    first.session.close()
    assert second.ask(Kind.SETUP_INPUTS, b"input_int_register_0") == b"\x03INT32"


@pytest.mark.parametrize(
    "payload", [b"", b"\x00", b"\x02\x00\x00\x00\x00", b"\x01\x00\x00", b"\x01" + bytes(9)]
)
def test_data_that_fits_no_recipe_is_an_error(payload):
    client = Client()
    client.ask(Kind.SETUP_INPUTS, b"input_int_register_0")
    with pytest.raises(RtdeError):
        client.session.feed(encode(Kind.DATA, payload))


@given(st.lists(st.tuples(KINDS, st.binary(max_size=60)), max_size=12), st.booleans())
def test_requests_of_any_kind_and_content_are_answered_or_a_typed_error(requests, as_version_2):
    client = Client(version=2 if as_version_2 else 1)
    try:
        for kind, payload in requests:
            client.session.feed(encode(kind, payload))
            client.data()
    except RtdeError:
        pass
    client.controller.step()
    assert np_finite(client.controller)


@given(st.binary(max_size=400))
def test_garbage_bytes_are_answered_or_a_typed_error(data):
    client = Client()
    try:
        reply = client.session.feed(data)
    except RtdeError:
        return
    assert isinstance(reply, bytes)


def np_finite(controller):
    return all(abs(x) < 1e6 for x in controller.outputs()["actual_q"])
