"""``rig sim fault``: what it orders, and what it says where there is nothing to order."""

from collections.abc import Iterator

import pytest

from sim_backend.loopback_rig.orders import ORDER_PORT, OrderServer
from tests.rig.command_line import rig
from tests.rig.loopback_served import free_host

pytestmark = pytest.mark.realtime


class Rig:
    """Remembers what was ordered; knows the faults of one kind of arm."""

    def __init__(self, *known: str) -> None:
        self._known = known
        self.ordered: list[tuple[str, float, float]] = []
        self.cleared = 0

    def fault(self, name: str, after_s: float, for_s: float) -> None:
        if name not in self._known:
            raise ValueError(f"no fault {name!r}; known: {', '.join(self._known)}")
        self.ordered.append((name, after_s, for_s))

    def clear(self) -> None:
        self.cleared += 1


@pytest.fixture
def host() -> str:
    return free_host()


@pytest.fixture(params=[("alarm", "reset"), ("protective_stop",)], ids=["gantry", "ur"])
def served(host: str, request: pytest.FixtureRequest) -> Iterator[Rig]:
    known = Rig(*request.param)
    server = OrderServer(host, known, ORDER_PORT)
    yield known
    server.close()


def test_either_arms_name_for_a_stop_reaches_it_with_a_word(served: Rig, host: str) -> None:
    for name in ("alarm", "protective_stop"):
        result = rig("sim", "fault", name, "--host", host, "--after", "1", "--for", "2")
        assert result.exit_code == 0, result.stderr
        assert ("comes nearest" in result.stderr) == (name not in served._known)
    assert served.ordered == [(served._known[0], 1.0, 2.0)] * 2


def test_clear_ends_all(served: Rig, host: str) -> None:
    assert rig("sim", "fault", "clear", "--host", host).exit_code == 0
    assert served.cleared == 1


def test_an_unknown_fault_is_refused_with_the_known_ones(served: Rig, host: str) -> None:
    result = rig("sim", "fault", "meteor", "--host", host)
    assert result.exit_code == 2
    assert served._known[0] in result.stderr and "camera_unplug" in result.stderr
    assert served.ordered == []


def test_without_a_served_rig_it_says_how_to_start_one(host: str) -> None:
    result = rig("sim", "fault", "stall", "--host", host)
    assert result.exit_code == 3
    assert "rig sim serve" in result.stderr
