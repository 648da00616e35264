"""Pictures of the board with the arm at rest, each with where the arm stood."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import DeviceTimeoutError
from drivers.interfaces import Camera, Frame, GreyImage
from rig.calibration.averaging import average_views, largest_motion_px
from rig.calibration.errors import CalibrationError
from rig.calibration.views import BoardView, PosedView
from rig.calibration_run.errors import FewPicturesError

# Finds the board's corners; raises CalibrationError with the reason when it cannot.
Detect = Callable[[GreyImage], BoardView]

_GUARD_S = 0.12  # stamps may be this wrong: a picture counts when stamped this long after rest
_PICTURES = 4  # averaged
_STILL_PX = 0.15  # motion of the corners' mean between pictures
_TIMEOUT_S = 2.5  # for the next picture
_LONGEST_S = 4 * _TIMEOUT_S


class Stand(Protocol):
    """What keeps the arm at rest, or waits until somebody else does."""

    @property
    def T_base_tool(self) -> NDArray[np.float64]:
        """The newest measured pose (4, 4)."""
        ...

    def settle(self) -> float:
        """The instant since which the arm rests; raises PoseRefusedError when it does not."""
        ...

    def wait(self, duration_s: float) -> None:
        """Let time pass while the arm rests."""
        ...


@dataclass(frozen=True, slots=True)
class Still:
    """One view at rest: the corners' mean over a few pictures, and the last picture."""

    view: PosedView
    image: GreyImage  # (height, width)
    t_s: float
    delay_s: float  # from the picture's stamp to the program's having it


class Photographer:
    """Takes stills with the camera of a rig whose arm rests on its stand."""

    def __init__(self, camera: Camera, stand: Stand, detect: Detect, clock: Clock) -> None:
        self._camera = camera
        self._stand = stand
        self._detect = detect
        self._clock = clock

    def take(self) -> Still:
        """A still from where the arm is, at rest by its own measurement and by the corners'.

        Raises CalibrationError when the board is not seen well or does not come to rest in the
        image, DeviceTimeoutError when no picture comes.
        """
        rest_s = self._stand.settle()
        views: list[BoardView] = []
        begin_s, reason, last, delay_s = self._clock.now_s(), "", None, 0.0
        flow = self._frames(begin_s + _TIMEOUT_S)
        for frame in flow:
            if frame.t_exposure_mid_s < rest_s + _GUARD_S:
                continue
            try:
                view = self._detect(frame.image)
            except CalibrationError as error:
                views, reason = [], str(error)
                if self._clock.now_s() - begin_s > 0.5 * _TIMEOUT_S:
                    break
                continue
            last, delay_s = frame, self._clock.now_s() - frame.t_exposure_mid_s
            views.append(view)
            # A camera of few pictures a second gets the time it needs.
            flow.until_s = min(self._clock.now_s() + _TIMEOUT_S, begin_s + _LONGEST_S)
            if largest_motion_px(views) > _STILL_PX:
                reason = "the board moves in the image although the arm is at rest"
                views = [view]
            if len(views) == _PICTURES:
                return Still(
                    PosedView(average_views(views), self._stand.T_base_tool),
                    frame.image,
                    frame.t_exposure_mid_s,
                    delay_s,
                )
        if last is None and not reason:
            raise DeviceTimeoutError(
                f"no picture within {_TIMEOUT_S} s: check the camera and its connection"
            )
        if not reason:
            raise FewPicturesError(
                f"only {len(views)} of {_PICTURES} pictures came within "
                f"{self._clock.now_s() - begin_s:.0f} s of rest: check the camera's rate, its "
                "cable and what else this machine does"
            )
        raise CalibrationError(reason)

    def _frames(self, until_s: float) -> "FrameFlow":
        return FrameFlow(self._camera, self._stand, self._clock, until_s)


class FrameFlow:
    """Iterates over new frames while the arm rests, until an instant."""

    def __init__(self, camera: Camera, stand: Stand, clock: Clock, until_s: float) -> None:
        self._camera = camera
        self._stand = stand
        self._clock = clock
        self.until_s = until_s

    def __iter__(self) -> "FrameFlow":
        return self

    def __next__(self) -> Frame:
        while self._clock.now_s() < self.until_s:
            frame = self._camera.read(timeout_s=0.0)
            if frame is not None:
                return frame
            self._stand.wait(0.01)
        raise StopIteration
