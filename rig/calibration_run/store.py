"""What was collected, kept on disk as it comes, so that an interrupted calibration goes on."""

import json
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.errors import ConfigError
from rig.calibration.views import BoardView, PosedView, StampedView
from rig.calibration_run.recording import Recording
from rig.calibration_run.stills import Still

FloatArray = NDArray[np.float64]

_CONDITIONS = "conditions.json"
_RECORDING = "recording.npz"


class Store:
    """A directory of stills and a recording that were taken under the same conditions.

    ``conditions`` names them (board, camera, arm); data taken under others cannot be resumed.
    Raises ConfigError where the directory cannot be written.
    """

    def __init__(self, directory: Path, conditions: Mapping[str, str], resume: bool) -> None:
        self._directory = directory
        self.stills: list[Still] = []
        self.recording: Recording | None = None
        try:
            directory.mkdir(parents=True, exist_ok=True)
            if resume:
                self._load(conditions)
            else:
                self._clear()
            text = json.dumps(dict(conditions), indent=2)
            (directory / _CONDITIONS).write_text(text + "\n", encoding="utf-8")
        except OSError as error:
            raise ConfigError(
                f"cannot write the calibration's data {directory}: {error}"
            ) from error

    def add_still(self, still: Still) -> None:
        """Keep a still; it is on disk when this returns."""
        path = self._directory / f"still-{len(self.stills):03d}"
        board = still.view.board
        cv2.imwrite(str(path.with_suffix(".png")), still.image)
        np.savez(
            path.with_suffix(".npz"),
            ids=board.ids,
            points_m=board.points_m,
            pixels=board.pixels,
            T_base_tool=still.view.T_base_tool,
            stamps=np.array([still.t_s, still.delay_s]),
        )
        self.stills.append(still)

    def set_recording(self, recording: Recording) -> None:
        """Keep a recording in place of the one before; it is on disk when this returns."""
        views = [view for segment in recording.segments for view in segment]
        np.savez(
            self._directory / _RECORDING,
            segments=np.array([len(segment) for segment in recording.segments]),
            counts=np.array([len(view.board) for view in views]),
            stamps=np.array([view.t_s for view in views]),
            ids=np.concatenate([view.board.ids for view in views]),
            points_m=np.concatenate([view.board.points_m for view in views]),
            pixels=np.concatenate([view.board.pixels for view in views]),
            times_s=recording.times_s,
            T_base_tool=recording.T_base_tool,
            delays_s=recording.delays_s,
            height=np.array(recording.height),
        )
        self.recording = recording

    def drop_recording(self) -> None:
        """Forget the recording, also on disk."""
        (self._directory / _RECORDING).unlink(missing_ok=True)
        self.recording = None

    def _clear(self) -> None:
        for pattern in ("still-*", _RECORDING):
            for path in self._directory.glob(pattern):
                path.unlink()

    def _load(self, conditions: Mapping[str, str]) -> None:
        path = self._directory / _CONDITIONS
        if not path.exists():
            raise ConfigError(f"{self._directory} holds nothing to resume: leave --resume out")
        before = json.loads(path.read_text(encoding="utf-8"))
        changed = [key for key in conditions if before.get(key) != conditions[key]]
        if changed:
            raise ConfigError(
                f"cannot resume: {', '.join(changed)} changed since the data in "
                f"{self._directory} were taken; leave --resume out to start anew"
            )
        self.stills = [_still(path) for path in sorted(self._directory.glob("still-*.npz"))]
        if (self._directory / _RECORDING).exists():
            self.recording = _recording(self._directory / _RECORDING)


def _still(path: Path) -> Still:
    with np.load(path) as data:
        board = BoardView(data["ids"], data["points_m"], data["pixels"])
        t_s, delay_s = data["stamps"]
        view = PosedView(board, data["T_base_tool"])
    image = cv2.imread(str(path.with_suffix(".png")), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise ConfigError(f"{path.with_suffix('.png')} is missing: leave --resume out")
    return Still(view, np.asarray(image, dtype=np.uint8), float(t_s), float(delay_s))


def _recording(path: Path) -> Recording:
    with np.load(path) as data:
        ends = np.cumsum(data["counts"])[:-1]
        parts = [np.split(data[name], ends) for name in ("ids", "points_m", "pixels")]
        views = [
            StampedView(BoardView(*part), float(t_s))
            for *part, t_s in zip(*parts, data["stamps"], strict=True)
        ]
        last = np.cumsum(data["segments"])
        segments = tuple(
            tuple(views[end - count : end])
            for end, count in zip(last, data["segments"], strict=True)
        )
        return Recording(
            segments, data["times_s"], data["T_base_tool"], data["delays_s"], int(data["height"])
        )
