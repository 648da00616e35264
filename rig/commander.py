"""The one way a command reaches the arm: limited, given a time to live, recorded."""

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import Arm, ArmState, JointArm
from estimator.estimate import Estimate
from rig.deadman import Deadman
from rig.envelope import Surroundings
from rig.log.run_log import RunLog
from rig.run_data import RunData
from rig.safety import Allowed, Limiter

FloatArray = NDArray[np.float64]


class Commander:
    """Sends tool twists through the limiter; each lives ``hold_s``, guarded by the deadman too."""

    def __init__(
        self,
        arm: Arm,
        limiter: Limiter,
        data: RunData,
        log: RunLog,
        hold_s: float,
        deadman: Deadman | None,
    ) -> None:
        self._arm = arm
        self._joint_arm: JointArm | None = arm if isinstance(arm, JointArm) else None
        self._limiter = limiter
        self._data = data
        self._log = log
        self._hold_s = hold_s
        self._deadman = deadman

    def send(
        self,
        now_s: float,
        wanted: FloatArray,
        state: ArmState,
        estimate: Estimate | None,
        dt_s: float,
    ) -> Allowed:
        """Command what the envelope allows of ``wanted`` (6,), a tool twist; says what that is."""
        allowed = self._limiter.limit(wanted, self._surroundings(state, estimate), dt_s)
        self._arm.command_twist(allowed.twist_tool, self._hold_s)
        if self._deadman is not None:
            self._deadman.feed()
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
