"""The wire format: exact bytes, any chopping, and no surprise from garbage."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.ur.rtde_codec import (
    FIELD_TYPES,
    FrameBuffer,
    Kind,
    Message,
    Recipe,
    RtdeError,
    encode,
    split_names,
)


def test_a_frame_is_size_type_payload_with_the_header_counted():
    assert encode(Kind.PROTOCOL_VERSION, b"\x00\x02") == b"\x00\x05V\x00\x02"
    assert encode(Kind.START) == b"\x00\x03S"


def test_a_payload_beyond_sixteen_bits_is_refused():
    assert len(encode(Kind.DATA, bytes(0xFFFF - 3))) == 0xFFFF
    with pytest.raises(RtdeError, match="does not fit"):
        encode(Kind.DATA, bytes(0xFFFF - 2))


messages = st.lists(
    st.builds(Message, st.integers(0, 255), st.binary(max_size=200)), min_size=1, max_size=8
)


@given(messages, st.lists(st.integers(0, 400), max_size=12))
def test_frames_survive_any_chopping(sent, cuts):
    stream = b"".join(encode(m.kind, m.payload) for m in sent)
    buffer, got, at = FrameBuffer(), [], 0
    for cut in [*sorted(c for c in cuts if c < len(stream)), len(stream)]:
        got += buffer.feed(stream[at:cut])
        at = cut
    assert got == sent


@given(st.lists(st.binary(max_size=300), max_size=10))
def test_garbage_gives_frames_or_a_typed_error(chunks):
    buffer, fed, used = FrameBuffer(), 0, 0
    try:
        for chunk in chunks:
            fed += len(chunk)
            used += sum(3 + len(m.payload) for m in buffer.feed(chunk))
    except RtdeError as error:
        assert "not RTDE" in str(error)
    assert used <= fed


def test_a_size_below_the_header_is_an_error():
    with pytest.raises(RtdeError, match="2 bytes long"):
        FrameBuffer().feed(b"\x00\x02V")


def test_names_may_end_in_a_comma():
    assert split_names(b"timestamp,actual_q,") == ["timestamp", "actual_q"]
    assert split_names(b"timestamp, actual_q") == ["timestamp", "actual_q"]
    assert split_names(b"") == []
    with pytest.raises(RtdeError):
        split_names(b"\xff\xfe")


def test_fields_are_packed_big_endian_in_order():
    recipe = Recipe(["DOUBLE", "INT32", "VECTOR3D", "BOOL"])
    payload = recipe.pack([1.5, -2, (1.0, 2.0, 3.0), True])
    assert payload == struct.pack(">di3d?", 1.5, -2, 1.0, 2.0, 3.0, True)
    assert recipe.unpack(payload) == [1.5, -2, (1.0, 2.0, 3.0), True]


@given(st.lists(st.sampled_from(sorted(FIELD_TYPES)), min_size=1, max_size=10), st.data())
def test_unpack_inverts_pack(types, data):
    values = []
    for name in types:
        code, count = FIELD_TYPES[name]
        one = {
            "?": st.booleans(),
            "d": st.floats(allow_nan=False),
            "B": st.integers(0, 2**8 - 1),
            "I": st.integers(0, 2**32 - 1),
            "Q": st.integers(0, 2**64 - 1),
            "i": st.integers(-(2**31), 2**31 - 1),
        }[code]
        drawn = data.draw(st.tuples(*[one] * count))
        values.append(drawn if count > 1 else drawn[0])
    recipe = Recipe(types)
    assert recipe.unpack(recipe.pack(values)) == values


@given(st.binary(max_size=64))
def test_only_the_exact_length_is_unpacked(payload):
    recipe = Recipe(["DOUBLE", "UINT32"])
    if len(payload) == recipe.size:
        assert len(recipe.unpack(payload)) == 2
    else:
        with pytest.raises(RtdeError, match="12 expected"):
            recipe.unpack(payload)


def test_unknown_types_and_misfits_are_errors():
    with pytest.raises(RtdeError, match="NOT_FOUND"):
        Recipe(["DOUBLE", "NOT_FOUND"])
    with pytest.raises(RtdeError, match="do not fit"):
        Recipe(["UINT8"]).pack([300])
    with pytest.raises(RtdeError, match="do not fit"):
        Recipe(["VECTOR3D"]).pack([(1.0, 2.0)])
