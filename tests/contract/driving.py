"""An open arm under test: commands as the control loop gives them, and what came of them."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol, cast

import numpy as np

from drivers.clock import WallClock
from drivers.errors import RigError
from drivers.interfaces import Arm, ArmState
from tests.contract.arms import Backend, FloatArray, Motion

TICK_S = 0.01
HOLD_S = 0.15
_STILL_M_S, _STILL_RAD_S = 1e-3, 4e-3


class Recoverable(Protocol):
    """An arm that a person can bring back after a failure."""

    def recover(self, confirm: Callable[[str], bool]) -> None: ...


class Driving:
    """One open arm of a backend; ``states`` is everything it reported."""

    def __init__(self, backend: Backend, arm: Arm) -> None:
        self.backend = backend
        self.clock = backend.clock
        self.arm = arm
        self.states: list[ArmState] = []

    def look(self, span_s: float) -> list[ArmState]:
        """Read states for a while without commanding anything."""
        return self._tick_for(span_s, lambda: None)

    def follow(self, twist: FloatArray, span_s: float, hold_s: float = HOLD_S) -> list[ArmState]:
        """Command ``twist`` every 10 ms for a while; raises what the arm raises."""
        return self._tick_for(span_s, lambda: self.arm.command_twist(twist, hold_s))

    def error_of(self, twist: FloatArray, within_s: float) -> RigError | None:
        """The error that ends ``follow``, None if none does within the time."""
        try:
            self.follow(twist, within_s)
        except RigError as error:
            return error
        return None

    def recover(self) -> None:
        """Bring a failed arm back, everything confirmed."""
        cast(Recoverable, self.arm).recover(lambda explanation: True)

    def truth(self, since_s: float) -> Motion:
        """What the tool did since then; on real devices nobody knows but the arm itself."""
        if self.backend.motion is not None:
            return self.backend.motion(since_s)
        states = [state for state in self.states if state.t_s >= since_s]
        return Motion(
            np.array([state.t_s for state in states]),
            np.array([state.T_base_tool for state in states]).reshape(-1, 4, 4),
            np.array([state.twist_tool for state in states]).reshape(-1, 6),
        )

    def last_motion_s(self, since_s: float) -> float:
        """The last instant at which the tool moved, ``since_s`` if it did not."""
        motion = self.truth(since_s)
        moving = (np.linalg.norm(motion.twist_tool[:, :3], axis=1) > _STILL_M_S) | (
            np.linalg.norm(motion.twist_tool[:, 3:], axis=1) > _STILL_RAD_S
        )
        return float(motion.t_s[moving].max()) if moving.any() else since_s

    def _tick_for(self, span_s: float, tick: Callable[[], None]) -> list[ArmState]:
        fresh: list[ArmState] = []
        next_s = self.clock.now_s()
        end_s = next_s + span_s
        while next_s < end_s:
            tick()
            next_s += TICK_S
            self.clock.sleep_until(next_s)
            fresh += self.arm.read_states()
        self.states += fresh
        return fresh


@contextmanager
def opened(backend: Backend) -> Iterator[Driving]:
    """A newly opened arm that has reported where it is."""
    driving = Driving(backend, backend.open())
    try:
        wall = WallClock()
        give_up_s = wall.now_s() + 5.0
        while not driving.states and wall.now_s() < give_up_s:
            driving.look(TICK_S)
        assert driving.states, "the arm reports nothing"
        yield driving
    finally:
        driving.arm.close()
