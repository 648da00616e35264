"""Arm samples and sightings in, the newest estimate out: each image used at its own instant."""

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.errors import OperateError, SafetyError
from drivers.interfaces import ArmState, Frame
from estimator.estimate import Correction, Estimate, Estimator
from estimator.twist_history import MotionUnknownError, TwistHistory
from rig.frames import uncertainty_at_camera
from rig.rolling_shutter import RollingShutter
from rig.run_data import RunData, Snapshot
from rig.vision import Sighting

FloatArray = NDArray[np.float64]

_PERIODS = 15  # the camera's period is the median over this many


class FusionLog(Protocol):
    """Who is told what went in and what came out."""

    def states(self, states: Sequence[ArmState]) -> None:
        """Arm samples that were read at once."""
        ...

    def frame(self, sighting: Sighting, handled_s: float) -> None:
        """One image's measurement, and when it was handled."""
        ...

    def estimate(self, kind: str, estimate: Estimate) -> None:
        """The state after an image (``kind`` update) or predicted to a tick (estimate)."""
        ...

    def event(self, t_s: float, name: str, detail: str = "") -> None:
        """Something that happened."""
        ...


class Fusion:
    """Keeps the estimator's state at the last image's exposure and predicts from there to now.

    Images were exposed ``stamps_late_s`` before their stamps, as the calibration found; with a
    rolling ``shutter``, stamps hold for the middle row.
    """

    def __init__(
        self,
        estimator: Estimator,
        data: RunData,
        log: FusionLog,
        max_extrapolation_s: float,
        stamps_late_s: float = 0.0,
        shutter: RollingShutter | None = None,
    ) -> None:
        self._estimator = estimator
        self._camera_from_tool = data.camera_from_tool
        self._motion = TwistHistory(max_extrapolation_s=max_extrapolation_s)
        self._data = data
        self._log = log
        self._stamps_late_s = stamps_late_s
        self._shutter = shutter
        # Sightings wait here until the arm has reported the motion up to their exposure.
        self._waiting: deque[Sighting] = deque()
        self._periods_s: deque[float] = deque(maxlen=_PERIODS)
        self._period_s: float | None = None
        self._newest_image: tuple[int, float] | None = None  # seq and exposure instant
        self._twist_covariance: FloatArray | None = None  # as the arm last reported it
        self._doubt = ""
        self.state: ArmState | None = None
        self.newest_sighting: Sighting | None = None
        self.last_image_s: float | None = None  # when the newest image was handled
        self.last_feature_s: float | None = None  # when the newest one used was exposed
        self.target_in_newest = False
        self.reason = "no image arrived yet"

    def add_states(self, states: list[ArmState]) -> None:
        """Record arm samples and the camera's motion they imply.

        Raises OperateError for samples that are no numbers or do not come one after the other.
        """
        if not states:
            return
        twists = np.array([state.twist_tool for state in states])
        try:
            self._motion.extend([state.t_s for state in states], twists @ self._camera_from_tool.T)
        except ValueError as error:
            raise OperateError(
                f"the arm reports what cannot be used ({error}): check its controller, start again"
            ) from error
        self._note_uncertainty(states[-1])
        self._data.arm_states.extend(states)
        self._log.states(states)
        self.state = states[-1]

    def add_sightings(self, sightings: list[Sighting], now_s: float) -> None:
        """Record sightings; those with a feature will correct the estimate."""
        for sighting in sightings:
            self._data.add_frame(sighting.frame.seq, sighting.measurement.found)
            self._note_period(sighting.frame)
            self.last_image_s = now_s
            self.newest_sighting = sighting
            self._log.frame(sighting, now_s)
            self.target_in_newest = sighting.measurement.found
            if sighting.measurement.found:
                self._waiting.append(self._corrected(sighting))
            else:
                self.reason = sighting.measurement.reason

    def advance(self, now_s: float) -> Estimate | None:
        """Use every sighting whose motion is known, then predict to ``now_s``.

        Returns None before the first feature. Raises SafetyError when the arm reports no motion
        at that time, or one that no arm can make.
        """
        try:
            while self._waiting and self._covered(self._waiting[0].frame.t_exposure_mid_s):
                self._correct(self._waiting.popleft())
            if self.last_feature_s is None:
                return None
            estimate = self._estimator.predict(now_s, self._motion)
        except (MotionUnknownError, ArithmeticError) as error:
            raise SafetyError(f"the measured motion cannot be used: {error}") from error
        self._log.estimate("estimate", estimate)
        return estimate

    def camera_speed_m_s(self) -> float:
        """The camera's newest measured speed."""
        if self.state is None:
            return 0.0
        return float(np.linalg.norm((self._camera_from_tool @ self.state.twist_tool)[:3]))

    @property
    def newest_update(self) -> Estimate | None:
        """The state after the last image used; None before the first."""
        return self._data.updates[-1] if self._data.updates else None

    @property
    def image_period_s(self) -> float | None:
        """The camera's period as its stamps show it, drops left aside; None: not known yet."""
        return self._period_s

    def _corrected(self, sighting: Sighting) -> Sighting:
        frame, feature = sighting.frame, sighting.measurement.feature
        t_s = frame.t_exposure_mid_s - self._stamps_late_s
        if self._shutter is not None and feature is not None:
            t_s += self._shutter.after_middle_s(feature.s, frame.image.shape[0])
        return replace(sighting, frame=replace(frame, t_exposure_mid_s=t_s))

    def _note_period(self, frame: Frame) -> None:
        seq, t_s = frame.seq, frame.t_exposure_mid_s
        if self._newest_image is not None and seq > self._newest_image[0]:
            passed_s = t_s - self._newest_image[1]
            if passed_s > 0.0:
                self._periods_s.append(passed_s / (seq - self._newest_image[0]))
                self._period_s = float(np.median(self._periods_s))
        self._newest_image = (seq, t_s)

    def _note_uncertainty(self, state: ArmState) -> None:
        """Tell the estimator how uncertain twists are, where the arm knows it."""
        reported = state.twist_covariance
        if reported is not None and reported is not self._twist_covariance:
            self._twist_covariance = reported
            self._motion.covariance, self._motion.density = uncertainty_at_camera(
                state, self._camera_from_tool
            )

    def _covered(self, t_s: float) -> bool:
        return self.state is not None and self.state.t_s >= t_s

    def _correct(self, sighting: Sighting) -> None:
        feature, t_s = sighting.measurement.feature, sighting.frame.t_exposure_mid_s
        assert feature is not None  # only found sightings wait
        if t_s < self._data.arm_states[0].t_s:
            return  # exposed before the arm's first sample: the motion since is unknown
        correction = self._estimator.correct(feature, t_s, self._motion)
        if correction is Correction.STALE:
            self._log.event(t_s, "stale image", f"frame {sighting.frame.seq} was not used")
            return
        self.last_feature_s = t_s
        if correction is Correction.REJECTED:
            self._log.event(t_s, "outlier", f"frame {sighting.frame.seq} was not used")
            return
        update = self._estimator.estimate
        assert update is not None  # it has just been corrected
        if correction is Correction.RESTARTED:
            why = update.doubt or "the target was out of sight too long"
            self._log.event(t_s, "estimator restarted", why)
        if update.doubt != self._doubt:
            self._doubt = update.doubt
            self._log.event(t_s, "estimate doubted", update.doubt or "no longer")
        self._data.updates.append(update)
        self._data.features.append(feature)
        self._data.add_snapshot(Snapshot(t_s, sighting.frame.image, feature))
        self._log.estimate("update", update)
