"""Collects stills from an arm that a person moves: shows what is seen, a key takes a picture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.errors import DeviceTimeoutError
from drivers.interfaces import Camera
from estimator.image.intrinsics import Intrinsics
from rig.calibration.board_pose import board_pose
from rig.calibration.errors import CalibrationError
from rig.calibration.views import BoardView
from rig.calibration_run.errors import PoseRefusedError
from rig.calibration_run.guidance import Guidance, guide, tilt_and_roll
from rig.calibration_run.hand_jog import HandJog
from rig.calibration_run.stills import Detect, Photographer, Still
from rig.calibration_run.store import Store

FloatArray = NDArray[np.float64]

_KEY_WAIT_S = 0.03
_FRAME_WAIT_S = 0.2
_SILENT_FRAMES = 15  # looks without a picture: the camera is gone
CAPTURE, UNDO, END = (" ", "c", "\n", "\r"), ("u",), ("q",)


@dataclass(frozen=True, slots=True)
class Glance:
    """What is seen right now."""

    problem: str  # why the board cannot be used, or ""
    corners: int
    place: str  # distance, tilt and roll in words
    poses: int
    needed: int
    wanted: int
    guidance: Guidance
    keys: int  # obeyed so far
    said: str  # what the last one did
    jogs: bool


class KeySource(Protocol):
    """Where keys come from."""

    def poll(self, wait_s: float) -> str:
        """The next key within ``wait_s``, or ""."""
        ...


class ByHand:
    """One session; ``run`` ends at the key q. ``jog`` is None for an arm moved otherwise."""

    def __init__(
        self,
        camera: Camera,
        photographer: Photographer,
        detect: Detect,
        intrinsics: Intrinsics,
        jog: HandJog | None,
        store: Store,
        needed: int,
        wanted: int,
    ) -> None:
        self._camera = camera
        self._photographer = photographer
        self._detect = detect
        self._intrinsics = intrinsics
        self._jog = jog
        self._store = store
        self._needed = needed
        self._wanted = wanted
        self._size = (0, 0)
        self._board_m: FloatArray | None = None
        self._keys, self._said = 0, ""
        self._silent = 0
        self._guidance = guide((), intrinsics, (0, 0), wanted)

    def run(self, keys: KeySource, show: Callable[[Glance], None], check_stop: Callable[[], None]
            ) -> Sequence[Still]:  # fmt: skip
        """Look, show and obey keys until q; raises DeviceTimeoutError when no pictures come."""
        self._refresh()
        while True:
            check_stop()
            show(self._glance())
            key = keys.poll(_KEY_WAIT_S)
            if key in END:
                return self._store.stills
            if key:
                self._obey(key)

    def _glance(self) -> Glance:
        problem, place, corners = "no new picture", "", 0
        frame = self._camera.read(timeout_s=_FRAME_WAIT_S)
        self._silent = 0 if frame is not None else self._silent + 1
        if self._silent > _SILENT_FRAMES:
            raise DeviceTimeoutError("no picture comes: check the camera and its connection")
        if frame is not None:
            self._size = (frame.image.shape[1], frame.image.shape[0])
            try:
                view = self._detect(frame.image)
                place, problem, corners = self._place_of(view), "", len(view)
            except CalibrationError as error:
                problem, self._board_m = str(error), None
        return Glance(
            problem,
            corners,
            place,
            len(self._store.stills),
            self._needed,
            self._wanted,
            self._guidance,
            self._keys,
            self._said,
            self._jog is not None,
        )

    def _place_of(self, view: BoardView) -> str:
        T = board_pose(view, self._intrinsics)
        middle = T[:3, :3] @ view.points_m.mean(axis=0) + T[:3, 3]
        self._board_m = middle
        across, along, roll = np.degrees(tilt_and_roll(T))
        return (
            f"{100 * np.linalg.norm(middle):.0f} cm away, tilted {across:+.0f}° across and "
            f"{along:+.0f}° along, rolled {roll:+.0f}°"
        )

    def _obey(self, key: str) -> None:
        self._keys += 1
        try:
            if key in CAPTURE:
                self._capture()
            elif key in UNDO:
                self._said = self._undo()
            elif self._jog is not None and self._jog.press(key, self._board_m):
                self._said = f"moved ({key})"
            else:
                self._said = f"{key!r} is no key here"
        except (CalibrationError, PoseRefusedError) as error:
            self._said = f"not done: {error}"
        self._refresh()

    def _capture(self) -> None:
        self._store.add_still(self._photographer.take())
        self._said = f"captured: pose {len(self._store.stills)}"

    def _undo(self) -> str:
        if not self._store.stills:
            return "there is nothing to take back"
        self._store.drop_still()
        return f"taken back: {len(self._store.stills)} poses left"

    def _refresh(self) -> None:
        stills = self._store.stills
        size = self._size
        if stills:
            size = (stills[0].image.shape[1], stills[0].image.shape[0])
        views = [still.view for still in stills]
        self._guidance = guide(views, self._intrinsics, size, self._wanted)
