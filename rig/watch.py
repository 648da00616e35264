"""What is wrong at this tick: ages, periods and contradictions as the supervisor's signs."""

import numpy as np

from drivers.interfaces import ArmState
from rig.config import RigConfig
from rig.fusion import Fusion
from rig.supervisor import Signs
from rig.vision import Vision


class Watch:
    """Looks at what came in; decides nothing."""

    def __init__(self, config: RigConfig, fusion: Fusion, vision: Vision) -> None:
        self._safety = config.safety
        self._hold_s = config.arm.hold_s
        self._fusion = fusion
        self._vision = vision
        self._started_s = 0.0
        self._contradicted_since_s: float | None = None

    def start(self, now_s: float) -> None:
        """Ages count from here until something arrives."""
        self._started_s = now_s

    def signs(
        self, now_s: float, last_tick_s: float, state: ArmState | None, envelope: str
    ) -> Signs:
        """This tick's signs; ``envelope`` names the barrier that blocks the motion, if any."""
        fusion = self._fusion
        image_s = self._started_s if fusion.last_image_s is None else fusion.last_image_s
        feature_s = self._started_s if fusion.last_feature_s is None else fusion.last_feature_s
        no_image = self._no_image(now_s - image_s)
        return Signs(
            now_s=now_s,
            seen=fusion.last_feature_s is not None,
            image_age_s=now_s - image_s,
            feature_age_s=now_s - feature_s,
            stale_state=self._stale(now_s, state),
            overrun=self._overrun(now_s - last_tick_s),
            no_image=no_image,
            target_lost="" if no_image else self._target_lost(now_s - feature_s),
            diverged=self._diverged(now_s),
            envelope=f"the motion is blocked by: {envelope}" if envelope else "",
        )

    def _stale(self, now_s: float, state: ArmState | None) -> str:
        if state is None or now_s - state.t_s <= self._safety.max_state_age_s:
            return ""
        return (
            f"the arm's newest state is {now_s - state.t_s:.3f} s old (limit "
            f"{self._safety.max_state_age_s:.3f} s): check its connection"
        )

    def _overrun(self, since_last_tick_s: float) -> str:
        """Whether the last command ran out before this tick could renew it."""
        if since_last_tick_s <= self._hold_s:
            return ""
        return (
            f"the loop was held up for {since_last_tick_s:.3f} s, longer than a command lives "
            f"({self._hold_s:.3f} s): the arm stopped by itself"
        )

    def _no_image(self, age_s: float) -> str:
        period_s = self._fusion.image_period_s
        if self._fusion.last_image_s is None:
            return f"no image arrived yet{self._camera_says('')}"
        if period_s is None:
            period_s = self._safety.max_feature_age_s / self._safety.no_image_periods
        if age_s <= self._safety.no_image_periods * period_s:
            return ""
        says = self._camera_says(": check the camera")
        return f"no image for {age_s:.2f} s ({age_s / period_s:.0f} periods){says}"

    def _camera_says(self, otherwise: str) -> str:
        problem = self._vision.problem()
        return otherwise if problem is None else f": {problem}"

    def _target_lost(self, age_s: float) -> str:
        fusion = self._fusion
        if fusion.last_feature_s is None:
            return fusion.reason
        if age_s <= self._safety.max_feature_age_s:
            return ""
        if fusion.target_in_newest:  # images do show it, but come too late to act upon
            return f"the newest image of the target is {age_s:.2f} s old"
        return fusion.reason

    def _diverged(self, now_s: float) -> str:
        """What contradicts the estimate, once it has done so for long enough."""
        update = self._fusion.newest_update
        text = ""
        if update is not None:
            residual = update.residual / float(np.linalg.norm(update.s))
            if not np.isfinite(update.chi) or update.chi <= 0.0:
                text = "the estimate has no positive radius"
            elif not residual <= self._safety.max_residual:
                text = f"images contradict the prediction by {100 * residual:.0f} % of s"
        if not text:
            self._contradicted_since_s = None
            return ""
        if self._contradicted_since_s is None:
            self._contradicted_since_s = now_s
        lasted_s = now_s - self._contradicted_since_s
        if lasted_s < self._safety.diverged_after_s:
            return ""
        return f"the estimate diverged: {text}"
