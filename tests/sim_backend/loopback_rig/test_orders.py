"""Faults ordered from another process reach the rig; mistakes are answered, not swallowed."""

import socket
from collections.abc import Iterator

import pytest

from sim_backend.loopback_rig.orders import OrderServer, order

HOST = "127.0.0.1"


class Rig:
    """Remembers what was ordered; knows one fault."""

    def __init__(self) -> None:
        self.ordered: list[tuple[str, float, float]] = []
        self.cleared = 0

    def fault(self, name: str, after_s: float, for_s: float) -> None:
        if name != "stall":
            raise ValueError(f"no fault {name!r}; known: stall")
        self.ordered.append((name, after_s, for_s))

    def clear(self) -> None:
        self.cleared += 1


@pytest.fixture
def served() -> Iterator[tuple[Rig, int]]:
    rig = Rig()
    server = OrderServer(HOST, rig, port=0)
    yield rig, server.port
    server.close()


def test_an_order_arrives_with_its_times(served: tuple[Rig, int]) -> None:
    rig, port = served
    order(HOST, {"fault": "stall", "after_s": 1.0, "for_s": 2.0}, port)
    order(HOST, {"do": "clear"}, port)
    assert rig.ordered == [("stall", 1.0, 2.0)]
    assert rig.cleared == 1


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ({"fault": "meteor"}, "known: stall"),
        ({"do": "dance"}, "unknown order"),
        ({"fault": "stall", "after_s": "soon"}, "soon"),
        ({}, "unknown order"),
    ],
)
def test_a_wrong_order_is_refused_in_words(
    served: tuple[Rig, int], request_: dict[str, object], words: str
) -> None:
    rig, port = served
    with pytest.raises(ValueError, match=words):
        order(HOST, request_, port)
    assert rig.ordered == []


@pytest.mark.parametrize("garbage", [b"\n", b"[1, 2]\n", b"\xff\xfe\n", b"{\n"])
def test_garbage_is_answered_and_the_next_order_works(
    served: tuple[Rig, int], garbage: bytes
) -> None:
    rig, port = served
    with socket.create_connection((HOST, port), timeout=5.0) as connection:
        connection.sendall(garbage)
        assert b"error" in connection.recv(1000)
    order(HOST, {"fault": "stall"}, port)
    assert rig.ordered == [("stall", 0.0, 0.0)]


def test_nobody_listening_is_an_os_error() -> None:
    with socket.socket() as free:
        free.bind((HOST, 0))
        port = free.getsockname()[1]
    with pytest.raises(OSError):
        order(HOST, {"do": "clear"}, port)
