"""Pictures while the camera wiggles in front of the board, with everything the arm reported."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import DeviceTimeoutError
from drivers.interfaces import Camera, Frame
from rig.calibration import se3
from rig.calibration.errors import CalibrationError
from rig.calibration.excitation import Excitation
from rig.calibration.trajectory import Trajectory
from rig.calibration.views import StampedView
from rig.calibration_run.mover import Mover
from rig.calibration_run.stills import Detect
from rig.calibration_run.watching import Progress
from rig.frames import twist_map

FloatArray = NDArray[np.float64]

_MARGIN_S = 0.7  # of rest before and after a segment
_LATENESS_S = 0.6  # stamps may be this wrong: pictures nearer to the record's ends are not used
_MOST_MISSING = 0.3  # share of a segment's pictures without the board
_DELAYS = 120  # pictures waited for, to see how long after their stamps they come
_READ_TIMEOUT_S = 0.5
_DRAWN_BACK_PER_S = 1.0
_LOST_S = 4.0  # without a picture for this long: something is wrong with the camera


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
    progress: Progress,
) -> Recording:
    """Wiggle once per segment and record; corners are found afterwards, when nothing moves.

    Raises CalibrationError when the board is missing from too many pictures, PoseRefusedError
    when the envelope is in the way, DeviceTimeoutError when the camera gives no pictures.
    """
    segments: list[list[Frame]] = []
    first = len(mover.states)

    last_s = clock.now_s()

    def collect(now_s: float) -> None:
        nonlocal last_s
        frame = camera.read(timeout_s=0.0)
        if frame is not None:
            segments[-1].append(frame)
            last_s = now_s
        _check_delivery(now_s - last_s)

    mover.on_tick = collect
    try:
        for number, motion in enumerate(motions, start=1):
            segments.append([])
            mover.wait(_MARGIN_S)
            twist_of = follower(mover.T_base_tool, T_tool_camera, motion)
            mover.follow(twist_of, motion.duration_s)
            mover.wait(_MARGIN_S)
            progress.done(number)
    finally:
        mover.on_tick = lambda now_s: None
    states = mover.states[first:]
    progress.step("latency", "how late pictures come", _DELAYS)
    delays_s = _delays(camera, clock, mover, progress)
    times_s = np.array([state.t_s for state in states])
    begin_s, end_s = times_s[0] + _LATENESS_S, times_s[-1] - _LATENESS_S
    usable = [[f for f in s if begin_s <= f.t_exposure_mid_s <= end_s] for s in segments]
    progress.step("latency", "corners", sum(len(frames) for frames in usable))
    views = _seen_in_all(usable, detect, mover, progress)
    return Recording(
        segments=views,
        times_s=times_s,
        T_base_tool=np.array([state.T_base_tool for state in states]),
        delays_s=delays_s,
        height=segments[0][0].image.shape[0],
    )


def follower(
    T_base_tool: FloatArray, T_tool_camera: FloatArray, motion: Excitation
) -> Callable[[float, FloatArray], FloatArray]:
    """The tool's twist by time and pose (4, 4) that gives the camera ``motion`` from here.

    It is also drawn back gently to where it should be: commands that come late on a busy
    machine would otherwise add up until the board leaves the view.
    """
    to_tool, start = twist_map(T_tool_camera), T_base_tool @ T_tool_camera

    def twist_of(t_s: float, T_base_tool: FloatArray) -> FloatArray:
        moved = motion.displacement(t_s)
        R = se3.exp(np.concatenate([np.zeros(3), moved[3:]]))[:3, :3]
        there = start @ se3.pose(R, moved[:3])
        off = se3.log(se3.inverse(T_base_tool @ T_tool_camera) @ there)
        return np.asarray(to_tool @ (motion.twist_camera(t_s) + _DRAWN_BACK_PER_S * off))

    return twist_of


def _check_delivery(since_s: float) -> None:
    if since_s > _LOST_S:
        raise DeviceTimeoutError(
            f"no picture for {since_s:.1f} s in the middle of a wiggle: check the camera and its "
            "connection"
        )


def _seen_in_all(
    segments: Sequence[Sequence[Frame]], detect: Detect, mover: Mover, progress: Progress
) -> tuple[tuple[StampedView, ...], ...]:
    """The board in the pictures of every segment."""
    looked_at = 0
    found = []
    for number, frames in enumerate(segments, start=1):
        views, reason = [], "no picture came"
        for frame in frames:
            mover.check_stop()
            try:
                views.append(StampedView(detect(frame.image), frame.t_exposure_mid_s))
            except CalibrationError as error:
                reason = str(error)
            looked_at += 1
            progress.done(looked_at)
        if not views or len(views) < (1.0 - _MOST_MISSING) * len(frames):
            raise CalibrationError(
                f"only {len(views)} of {len(frames)} pictures of wiggle {number} show the board: "
                f"{reason}"
            )
        found.append(tuple(views))
    return tuple(found)


def _delays(camera: Camera, clock: Clock, mover: Mover, progress: Progress) -> FloatArray:
    """How long after their stamps pictures come, each waited for."""
    delays = []
    camera.read(timeout_s=0.0)  # one that waited already
    for number in range(_DELAYS):
        mover.check_stop()
        frame = camera.read(timeout_s=_READ_TIMEOUT_S)
        if frame is not None:
            delays.append(clock.now_s() - frame.t_exposure_mid_s)
        progress.done(number + 1)
    return np.array(delays)
