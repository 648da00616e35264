"""The one way a run's commands reach the arm: with what is around it, sent, recorded."""

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.interfaces import Arm, ArmState, JointArm
from estimator.estimate import Estimate
from rig.deadman import Deadman
from rig.envelope import Surroundings
from rig.log.run_log import RunLog
from rig.run_data import RunData
from rig.safety import Allowed, Limiter
from rig.sender import Sender

FloatArray = NDArray[np.float64]


class Commander:
    """Sends tool twists through the limiter and records them."""

    def __init__(
        self,
        arm: Arm,
        clock: Clock,
        limiter: Limiter,
        data: RunData,
        log: RunLog,
        hold_s: float,
        deadman: Deadman | None,
    ) -> None:
        self._joint_arm: JointArm | None = arm if isinstance(arm, JointArm) else None
        self._limiter = limiter
        self._data = data
        self._log = log
        self._sender = Sender(arm, clock, limiter, hold_s, deadman)

    def send(
        self,
        now_s: float,
        wanted: FloatArray,
        state: ArmState,
        estimate: Estimate | None,
        dt_s: float,
    ) -> Allowed:
        """Command what the envelope allows of ``wanted`` (6,), a tool twist; says what that is.

        ``now_s`` is the tick's instant.
        """
        allowed = self._sender.send(wanted, self._surroundings(state, estimate), now_s, dt_s)
        self._log.command(
            now_s, wanted, allowed.twist_tool, state.twist_tool, list(allowed.reasons)
        )
        return allowed

    def still_blocked(self, wanted: FloatArray, state: ArmState, estimate: Estimate | None) -> str:
        """The barrier that keeps a blocked motion back, or ""; sends nothing."""
        return self._limiter.still_blocked(wanted, self._surroundings(state, estimate))

    def restart(self) -> None:
        """Ramp from the measured motion next time: the last commands ran out."""
        self._limiter.restart()

    def _surroundings(self, state: ArmState, estimate: Estimate | None) -> Surroundings:
        snapshot = self._data.newest_snapshot
        return Surroundings(
            state=state,
            target=estimate,
            joints=None if self._joint_arm is None else self._joint_arm.joints(),
            image_shape=None if snapshot is None else snapshot.image.shape,
        )
