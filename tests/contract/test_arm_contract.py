"""One contract for every arm: simulated, emulated behind its true protocol and, if there, real.

What an arm truly does is measured where it happens: in the simulated world, at the emulated
controller; on a real device in its own reports.
"""

from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np
import pytest

from drivers.errors import OperateError
from tests.contract.arms import (
    Backend,
    loopback_gantry,
    loopback_ur,
    real_gantry,
    real_ur,
    simulated,
)
from tests.contract.driving import HOLD_S, Driving, opened

pytestmark = pytest.mark.realtime

REST = np.zeros(6)


EMULATED = (simulated, loopback_ur, loopback_gantry)
REAL = {"--ur-host": real_ur, "--grbl-port": real_gantry}


@pytest.fixture(
    scope="module",
    params=[*EMULATED, *(pytest.param(name, marks=pytest.mark.hardware(name)) for name in REAL)],
    ids=lambda param: REAL[param].__name__ if param in REAL else param.__name__,
)
def backend(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Backend]:
    with ExitStack() as stack:
        if request.param in REAL:
            yield REAL[request.param](request.config.getoption(request.param))
        else:
            yield request.param(stack, tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="module")
def shared(backend: Backend) -> Iterator[Driving]:
    """One open arm for the tests that leave it as they found it: at rest and healthy."""
    with opened(backend) as driving:
        yield driving


@pytest.fixture
def driving(shared: Driving) -> Iterator[Driving]:
    """The shared arm at rest, its old states read."""
    shared.look(0.05)
    shared.states.clear()
    yield shared
    shared.arm.stop()
    shared.look(shared.backend.stop_s + 0.1)


def test_states_are_stamped_in_order_when_they_were_true_and_come_once(driving: Driving) -> None:
    backend, clock = driving.backend, driving.clock
    stamps: list[float] = []
    ages: list[float] = []
    begun_s = clock.now_s()
    while clock.now_s() < begun_s + 0.6:
        fresh = driving.look(0.01)
        stamps += [state.t_s for state in fresh]
        if fresh:
            ages.append(clock.now_s() - fresh[-1].t_s)
    assert np.all(np.diff(stamps) > 0.0)
    assert np.median(np.diff(stamps)) == pytest.approx(backend.period_s, rel=0.3)
    assert len(stamps) > 0.7 * 0.6 / backend.period_s
    assert min(ages) >= 0.0
    assert max(ages) < backend.max_age_s
    assert stamps[0] > begun_s - backend.max_age_s


def test_without_a_command_nothing_moves(driving: Driving) -> None:
    begun_s = driving.clock.now_s()
    driving.look(0.3)
    assert driving.last_motion_s(begun_s) == begun_s


def test_the_tool_follows_the_twist_in_its_own_axes_and_says_so(driving: Driving) -> None:
    backend = driving.backend
    driving.follow(backend.twist, backend.settle_s)
    settled_s = driving.clock.now_s()
    states = driving.follow(backend.twist, 0.4)
    truth = driving.truth(settled_s)
    # The middle one, because a busy host can starve a driver so that the motion pauses.
    true = np.median(truth.twist_tool, axis=0)
    for part in (slice(0, 3), slice(3, 6)):
        wanted = backend.twist[part]
        error = np.linalg.norm(true[part] - wanted)
        assert error < backend.twist_error * np.linalg.norm(wanted) + 1e-4
    # The reports: the pose that was true at each stamp, and the twist that leads along it.
    for state in states:
        k = int(np.argmin(np.abs(truth.t_s - state.t_s)))
        if abs(truth.t_s[k] - state.t_s) < 0.002:
            step = state.T_base_tool[:3, 3] - truth.T_base_tool[k, :3, 3]
            assert np.linalg.norm(step) < backend.pose_error_m
    first, last = states[0], states[-1]
    v_base = np.array([state.T_base_tool[:3, :3] @ state.twist_tool[:3] for state in states])
    travelled = np.trapezoid(v_base, x=[state.t_s for state in states], axis=0)
    moved = last.T_base_tool[:3, 3] - first.T_base_tool[:3, 3]
    assert np.linalg.norm(travelled - moved) < 0.02 * np.linalg.norm(moved) + backend.pose_error_m


def test_the_newest_twist_replaces_the_one_before(driving: Driving) -> None:
    backend = driving.backend
    driving.follow(backend.twist, backend.settle_s)
    driving.follow(-backend.twist, backend.settle_s + 0.1)
    turned_s = driving.clock.now_s()
    driving.follow(-backend.twist, 0.2)
    true = np.median(driving.truth(turned_s).twist_tool, axis=0)
    error = np.linalg.norm(true[:3] + backend.twist[:3])
    assert error < (backend.twist_error + 0.02) * np.linalg.norm(backend.twist[:3]) + 1e-4


def test_it_stops_by_itself_when_the_command_has_outlived_its_time(driving: Driving) -> None:
    backend = driving.backend
    driving.follow(backend.twist, backend.settle_s)
    last_s = driving.clock.now_s()
    driving.arm.command_twist(backend.twist, HOLD_S)
    driving.look(HOLD_S + backend.stop_s + 0.3)
    stopped_s = driving.last_motion_s(last_s)
    assert last_s < stopped_s < last_s + HOLD_S + backend.stop_s


def test_stop_brakes_and_a_second_stop_changes_nothing(driving: Driving) -> None:
    backend = driving.backend
    driving.follow(backend.twist, backend.settle_s, hold_s=1.0)
    asked_s = driving.clock.now_s()
    driving.arm.stop()
    driving.arm.stop()
    driving.look(backend.stop_s + 0.2)
    driving.arm.stop()
    driving.look(0.1)
    assert asked_s < driving.last_motion_s(asked_s) < asked_s + backend.stop_s
    driving.follow(-backend.twist, backend.settle_s)
    assert driving.last_motion_s(asked_s) > asked_s + backend.stop_s + 0.3


NO_COMMANDS = (
    (np.full(6, np.nan), HOLD_S),
    (np.array([0.0, 0.0, 0.0, 0.0, np.inf, 0.0]), HOLD_S),
    (np.zeros(5), HOLD_S),
    (REST, np.inf),
    (REST, np.nan),
    (REST, -1.0),
)


def test_what_is_no_command_is_refused_and_stops_the_arm(driving: Driving) -> None:
    backend = driving.backend
    driving.follow(backend.twist, 0.2, hold_s=1.0)
    refused_s = driving.clock.now_s()
    for twist, hold_s in NO_COMMANDS:
        with pytest.raises(OperateError, match="refused"):
            driving.arm.command_twist(twist, hold_s)
    driving.look(backend.stop_s + 0.1)
    assert driving.last_motion_s(refused_s) < refused_s + backend.stop_s


def test_closing_stops_and_a_closed_arm_takes_nothing(shared: Driving) -> None:
    """Last on the shared arm, which the next module would open anew."""
    backend = shared.backend
    shared.follow(backend.twist, backend.settle_s, hold_s=1.0)
    closed_s = shared.clock.now_s()
    shared.arm.close()
    shared.arm.close()
    shared.clock.sleep_until(closed_s + backend.stop_s + 0.1)
    if backend.motion is not None:
        assert shared.last_motion_s(closed_s) < closed_s + backend.stop_s
    with pytest.raises(OperateError, match="close"):
        shared.arm.command_twist(REST, HOLD_S)
    shared.arm.stop()
