"""Pictures while the camera wiggles in front of the board, with everything the arm reported."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.interfaces import Camera, Frame
from rig.calibration.errors import CalibrationError
from rig.calibration.excitation import Excitation
from rig.calibration.trajectory import Trajectory
from rig.calibration.views import StampedView
from rig.calibration_run.mover import Mover
from rig.calibration_run.stills import Detect
from rig.frames import twist_map

FloatArray = NDArray[np.float64]

_MARGIN_S = 0.7  # of rest before and after a segment
_LATENESS_S = 0.6  # stamps may be this wrong: pictures nearer to the record's ends are not used
_MOST_MISSING = 0.3  # share of a segment's pictures without the board
_DELAYS = 120  # pictures waited for, to see how long after their stamps they come
_READ_TIMEOUT_S = 0.5


@dataclass(frozen=True, slots=True)
class Recording:
    """Segments of motion, in one unbroken record of the arm."""

    segments: tuple[tuple[StampedView, ...], ...]
    times_s: FloatArray  # (n,) of the arm's samples
    T_base_tool: FloatArray  # (n, 4, 4)
    delays_s: FloatArray  # (k,) from a picture's stamp to the program's having it
    height: int  # of the pictures, px

    def trajectory(self) -> Trajectory:
        """The arm's motion; raises CalibrationError where its record has gaps."""
        return Trajectory(self.times_s, self.T_base_tool)


def record(
    camera: Camera,
    mover: Mover,
    clock: Clock,
    detect: Detect,
    motions: Sequence[Excitation],
    T_tool_camera: FloatArray,
) -> Recording:
    """Wiggle once per segment and record; corners are found afterwards, when nothing moves.

    Raises CalibrationError when the board is missing from too many pictures, PoseRefusedError
    when the envelope is in the way.
    """
    segments: list[list[Frame]] = []
    first = len(mover.states)
    to_tool = twist_map(T_tool_camera)

    def collect(now_s: float) -> None:
        frame = camera.read(timeout_s=0.0)
        if frame is not None:
            segments[-1].append(frame)

    mover.on_tick = collect
    try:
        for motion in motions:
            segments.append([])
            mover.wait(_MARGIN_S)
            mover.follow(_follower(to_tool, motion), motion.duration_s)
            mover.wait(_MARGIN_S)
    finally:
        mover.on_tick = lambda now_s: None
    states = mover.states[first:]
    delays_s = _delays(camera, clock)
    times_s = np.array([state.t_s for state in states])
    begin_s, end_s = times_s[0] + _LATENESS_S, times_s[-1] - _LATENESS_S
    usable = [[f for f in s if begin_s <= f.t_exposure_mid_s <= end_s] for s in segments]
    views = tuple(_seen(number, frames, detect) for number, frames in enumerate(usable, start=1))
    return Recording(
        segments=views,
        times_s=times_s,
        T_base_tool=np.array([state.T_base_tool for state in states]),
        delays_s=delays_s,
        height=segments[0][0].image.shape[0],
    )


def _follower(to_tool: FloatArray, motion: Excitation) -> Callable[[float], FloatArray]:
    """The tool's twist over time that gives the camera ``motion``."""
    return lambda t_s: np.asarray(to_tool @ motion.twist_camera(t_s))


def _seen(number: int, frames: list[Frame], detect: Detect) -> tuple[StampedView, ...]:
    views, reason = [], "no picture came"
    for frame in frames:
        try:
            views.append(StampedView(detect(frame.image), frame.t_exposure_mid_s))
        except CalibrationError as error:
            reason = str(error)
    if not views or len(views) < (1.0 - _MOST_MISSING) * len(frames):
        raise CalibrationError(
            f"only {len(views)} of {len(frames)} pictures of wiggle {number} show the board: "
            f"{reason}"
        )
    return tuple(views)


def _delays(camera: Camera, clock: Clock) -> FloatArray:
    """How long after their stamps pictures come, each waited for."""
    delays = []
    camera.read(timeout_s=0.0)  # one that waited already
    for _ in range(_DELAYS):
        frame = camera.read(timeout_s=_READ_TIMEOUT_S)
        if frame is not None:
            delays.append(clock.now_s() - frame.t_exposure_mid_s)
    return np.array(delays)
