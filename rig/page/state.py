"""What the page shows at one instant, as it travels to the process that serves it."""

import json
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState
from estimator.estimate import Estimate
from estimator.image.feature import Feature
from rig.outcome import LiveStatus
from rig.spread import left_m
from rig.vision.sighting import Sighting

FloatArray = NDArray[np.float64]
Numbers = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PageState:
    """Plain numbers only; None where something is not known yet."""

    elapsed_s: float
    state: str  # the supervisor's, with its reason
    target_state: str
    frames: int
    frames_lost: int
    ticks: int
    overruns: int
    late_s: float
    speed_m_s: float
    limited_by: tuple[str, ...]
    radius_m: float | None = None
    spread_m: float | None = None  # of the radius
    spread_stated: bool = False  # by the estimator as one standard deviation, else judged
    s: Numbers | None = None  # (3,)
    axis: Numbers | None = None  # (3,), cylinder only
    T_base_tool: Numbers | None = None  # (12,) the upper three rows
    image: int | None = None  # its number
    image_reason: str = ""  # why nothing was measured in it
    image_s: Numbers | None = None  # the feature measured in it
    image_axis: Numbers | None = None

    @property
    def feature(self) -> Feature | None:
        """What was measured in the image; its covariance does not travel."""
        if self.image_s is None:
            return None
        axis = None if self.image_axis is None else np.array(self.image_axis)
        return Feature(np.array(self.image_s), np.zeros((3, 3)), axis)

    def to_bytes(self) -> bytes:
        """JSON; what is not finite is left out by whoever made the state."""
        return json.dumps(asdict(self)).encode()


def state_of_bytes(message: bytes) -> PageState:
    """The other way round."""
    values = json.loads(message)
    for name, value in values.items():
        if isinstance(value, list):
            values[name] = tuple(value)
    return PageState(**values)


def state_of(
    status: LiveStatus, shown: Sighting | None, first_chi: float | None, image: int | None
) -> PageState:
    """What a status means to the page.

    ``shown`` is the sighting whose image has the number ``image``; ``first_chi`` is the estimate
    that the run began with.
    """
    state = PageState(
        elapsed_s=status.elapsed_s,
        state=str(status.state),
        target_state=status.target_state,
        frames=status.frames,
        frames_lost=status.frames_lost,
        ticks=status.ticks,
        overruns=status.overruns,
        late_s=status.late_s,
        speed_m_s=status.speed_m_s,
        limited_by=status.limited_by,
        image=image,
    )
    if shown is not None:
        state = with_feature(state, shown.measurement.feature, shown.measurement.reason)
    state = with_arm(state, status.arm)
    return with_estimate(state, status.estimate, first_chi, status.remaining_fraction)


def with_feature(state: PageState, feature: Feature | None, reason: str = "") -> PageState:
    """``state`` with what was measured in its image, or why nothing was."""
    if feature is None:
        return replace(state, image_reason=reason)
    axis = None if feature.axis is None else _numbers(feature.axis)
    return replace(state, image_s=_numbers(feature.s), image_axis=axis)


def with_arm(state: PageState, arm: ArmState | None) -> PageState:
    """``state`` with the arm's pose."""
    return state if arm is None else replace(state, T_base_tool=_numbers(arm.T_base_tool[:3]))


def with_estimate(
    state: PageState, estimate: Estimate | None, first_chi: float | None, left: float
) -> PageState:
    """``state`` with an estimate and how far it may be off."""
    radius_m = None if estimate is None else estimate.radius_m
    if estimate is None or radius_m is None or not np.isfinite(radius_m):
        return state
    stated = estimate.radius_std_m
    judged = None if first_chi is None else left_m(estimate.chi, first_chi, left)
    return replace(
        state,
        radius_m=radius_m,
        spread_m=judged if stated is None else stated,
        spread_stated=stated is not None,
        s=_numbers(estimate.s),
        axis=None if estimate.axis is None else _numbers(estimate.axis),
    )


def _numbers(values: FloatArray) -> Numbers:
    return tuple(float(value) for value in values.ravel())
