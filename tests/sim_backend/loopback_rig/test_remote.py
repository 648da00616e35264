"""A camera's view of a controller in another process: the same motion, gaps survived."""

import numpy as np
import pytest

from sim_backend.clock import SimulatedClock
from sim_backend.loopback_rig.remote import RemoteMotion

STEP_S = 0.002
T_TOOL_CAMERA = np.eye(4)
T_TOOL_CAMERA[:3, 3] = (0.0, 0.0, 0.1)


class Recording:
    """A controller whose first joint moves at 0.1 m/s, kept for ``kept_s``."""

    def __init__(self, clock: SimulatedClock, kept_s: float = 100.0) -> None:
        self._clock = clock
        self._kept_s = kept_s

    def motion(self, since_s: float) -> np.ndarray:
        now_s = self._clock.now_s()
        since_s = max(since_s, now_s - self._kept_s, 0.0)
        numbers = np.arange(np.ceil(since_s / STEP_S - 1e-6), np.floor(now_s / STEP_S + 1e-6) + 1)
        rows = np.zeros((len(numbers), 13))
        rows[:, 0] = numbers * STEP_S
        rows[:, 1] = 0.1 * rows[:, 0]
        rows[:, 7] = 0.1
        return rows


def tool_pose(q: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[0, 3] = q[0]
    return T


def test_the_camera_is_where_the_tool_carries_it() -> None:
    clock = SimulatedClock(1.0)
    motion = RemoteMotion(Recording(clock), tool_pose, T_TOOL_CAMERA, clock)
    clock.sleep_until(2.0)
    assert motion.sync() == pytest.approx(2.0)
    assert np.allclose(motion.T_base_camera(1.7003)[:3, 3], [0.17003, 0.0, 0.1])


def test_nothing_is_invented_beyond_what_was_fetched() -> None:
    clock = SimulatedClock(1.0)
    motion = RemoteMotion(Recording(clock), tool_pose, T_TOOL_CAMERA, clock)
    clock.sleep_until(2.0)
    with pytest.raises(ValueError, match="outside the recorded motion"):
        motion.T_base_camera(1.5)


def test_a_record_with_a_gap_starts_again_after_it() -> None:
    clock = SimulatedClock(1.0)
    motion = RemoteMotion(Recording(clock, kept_s=0.5), tool_pose, T_TOOL_CAMERA, clock)
    clock.sleep_until(5.0)
    motion.sync()
    assert motion.T_base_camera(4.8)[0, 3] == pytest.approx(0.48)
    with pytest.raises(ValueError, match="outside the recorded motion"):
        motion.T_base_camera(1.0)


def test_a_controller_that_has_just_started_is_waited_for() -> None:
    clock = SimulatedClock(0.0)
    motion = RemoteMotion(Recording(clock), tool_pose, T_TOOL_CAMERA, clock)
    assert motion.sync() <= clock.now_s()
    assert clock.now_s() > 0.0
