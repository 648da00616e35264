"""The parser of multipart streams, on bytes."""

import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.camera.multipart import MultipartParser, Part, StreamError

BODIES = st.lists(st.binary(max_size=200), max_size=6)


def encode(bodies: list[bytes], with_length: bool) -> bytes:
    out = b""
    for body in bodies:
        length = f"Content-Length: {len(body)}\r\n".encode() if with_length else b""
        out += b"--edge\r\nContent-Type: image/jpeg\r\n" + length + b"\r\n" + body + b"\r\n"
    return out


def parse_in_pieces(data: bytes, cuts: list[int]) -> list[Part]:
    parser, out, start = MultipartParser("edge"), [], 0
    for cut in [*sorted(c % (len(data) + 1) for c in cuts), len(data)]:
        out += parser.feed(data[start:cut])
        start = cut
    return out


@given(BODIES, st.lists(st.integers(0, 5000), max_size=20))
@settings(max_examples=100, deadline=None)
def test_bodies_come_back_whatever_they_hold_and_however_they_are_cut(
    bodies: list[bytes], cuts: list[int]
) -> None:
    parts = parse_in_pieces(encode(bodies, with_length=True), cuts)
    assert [part.body for part in parts] == bodies
    assert all(part.headers["content-type"] == "image/jpeg" for part in parts)


@given(st.lists(st.binary(min_size=1, max_size=50), max_size=5), st.lists(st.integers(0, 2000)))
@settings(max_examples=100, deadline=None)
def test_without_lengths_a_part_ends_where_the_next_begins(
    bodies: list[bytes], cuts: list[int]
) -> None:
    # A body that ends in a line break is not to be told from one that does not: pad it.
    bodies = [body.replace(b"--edge", b"") + b"." for body in bodies]
    data = encode(bodies, with_length=False) + b"--edge"
    assert [part.body for part in parse_in_pieces(data, cuts)] == bodies


@given(st.lists(st.binary(max_size=300), max_size=10))
@settings(max_examples=200, deadline=None)
def test_garbage_gives_parts_or_a_typed_error(chunks: list[bytes]) -> None:
    parser = MultipartParser("edge")
    with contextlib.suppress(StreamError):
        for chunk in chunks:
            parser.feed(b"--edge\r\n" + chunk)


def test_a_stream_without_any_boundary_is_an_error_before_it_fills_the_memory() -> None:
    parser = MultipartParser("edge")
    with pytest.raises(StreamError, match="boundary"):
        for _ in range(100):
            parser.feed(b"x" * 1000)


def test_a_header_without_end_is_an_error() -> None:
    parser = MultipartParser("edge")
    with pytest.raises(StreamError, match="header"):
        for _ in range(100):
            parser.feed(b"--edge" + b"x" * 1000)


@pytest.mark.parametrize("length", ["-1", "1e9", "x", "99999999999999999999999999", "²"])
def test_a_nonsense_length_is_an_error(length: str) -> None:
    head = b"--edge\r\nContent-Length: " + length.encode("latin-1") + b"\r\n\r\n"
    with pytest.raises(StreamError, match="announces"):
        MultipartParser("edge").feed(head)


def test_dashes_and_quotes_in_the_announced_boundary_do_not_matter() -> None:
    data = encode([b"a"], with_length=True)
    for boundary in ("edge", "--edge", '"edge"'):
        assert [part.body for part in MultipartParser(boundary).feed(data)] == [b"a"]
