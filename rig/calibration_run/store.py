"""What was collected, kept on disk as it comes, so that an interrupted calibration goes on."""

import io
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from zipfile import BadZipFile

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
    Without ``resume`` what was there before stays until the first new still is added. Every
    file is written as a whole or not at all. Raises ConfigError where that is not possible, and
    where there is nothing to resume; ``instead`` says what to do then.
    """

    def __init__(
        self,
        directory: Path,
        conditions: Mapping[str, str],
        resume: bool,
        instead: str = "leave --resume out to start anew",
    ) -> None:
        self.directory = directory
        self._instead = instead
        self._conditions = dict(conditions)
        self._begun = resume
        self.stills: list[Still] = []
        self.recording: Recording | None = None
        self._resumed: dict[str, str] | None = None  # what the data resumed were taken under
        with self._writing():
            directory.mkdir(parents=True, exist_ok=True)
            _replace(directory / "writable", b"")
            (directory / "writable").unlink()
        if resume:
            self._load()

    def also_under(self, conditions: Mapping[str, str]) -> None:
        """Add conditions that only open devices tell, before anything is collected.

        Raises ConfigError when data that are resumed were taken under others.
        """
        self._conditions.update(conditions)
        if self._resumed is not None:
            self._check_same(self._resumed)

    def add_still(self, still: Still) -> None:
        """Keep a still; it is on disk when this returns."""
        board = still.view.board
        done, png = cv2.imencode(".png", still.image)
        assert done  # a grey image always is a PNG
        data = _npz(
            ids=board.ids,
            points_m=board.points_m,
            pixels=board.pixels,
            T_base_tool=still.view.T_base_tool,
            stamps=np.array([still.t_s, still.delay_s]),
        )
        with self._writing():
            self._begin()
            path = self.directory / f"still-{len(self.stills):03d}"
            # The picture first: what the numbers are looked for by is there last.
            _replace(path.with_suffix(".png"), np.asarray(png).tobytes())
            _replace(path.with_suffix(".npz"), data)
        self.stills.append(still)

    def drop_still(self) -> None:
        """Forget the last still, also on disk."""
        path = self.directory / f"still-{len(self.stills) - 1:03d}"
        with self._writing():
            path.with_suffix(".npz").unlink(missing_ok=True)
            path.with_suffix(".png").unlink(missing_ok=True)
        self.stills.pop()

    def set_recording(self, recording: Recording) -> None:
        """Keep a recording in place of the one before; it is on disk when this returns."""
        views = [view for segment in recording.segments for view in segment]
        data = _npz(
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
        with self._writing():
            _replace(self.directory / _RECORDING, data)
        self.recording = recording

    def drop_recording(self) -> None:
        """Forget the recording, also on disk."""
        with self._writing():
            (self.directory / _RECORDING).unlink(missing_ok=True)
        self.recording = None

    def _begin(self) -> None:
        """Make room for new data, once."""
        if self._begun:
            return
        for pattern in ("still-*", _RECORDING):
            for path in self.directory.glob(pattern):
                path.unlink()
        text = json.dumps(self._conditions, indent=2) + "\n"
        _replace(self.directory / _CONDITIONS, text.encode())
        self._begun = True

    def _load(self) -> None:
        path = self.directory / _CONDITIONS
        if not path.exists():
            raise ConfigError(f"{self.directory} holds nothing to resume: {self._instead}")
        with self._readable():
            before = dict(json.loads(path.read_text(encoding="utf-8")))
        self._resumed = before
        self._check_same(before)
        with self._readable():
            self.stills = [_still(one) for one in sorted(self.directory.glob("still-*.npz"))]
            if (self.directory / _RECORDING).exists():
                self.recording = _recording(self.directory / _RECORDING)

    def _check_same(self, before: Mapping[str, str]) -> None:
        changed = [key for key, now in self._conditions.items() if before.get(key) != now]
        if changed:
            self.stills, self.recording = [], None  # of no use now, though still on disk
            raise ConfigError(
                f"cannot resume: {', '.join(changed)} changed since the data in "
                f"{self.directory} were taken: {self._instead}"
            )

    @contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError, TypeError, KeyError, BadZipFile) as error:
            raise ConfigError(
                f"the data in {self.directory} cannot be read ({error}): {self._instead}"
            ) from error

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise ConfigError(
                f"cannot write the calibration's data in {self.directory}: {error}"
            ) from error


def _npz(**arrays: NDArray[np.generic]) -> bytes:
    out = io.BytesIO()
    np.savez(out, **arrays)  # type: ignore[arg-type]
    return out.getvalue()


def _replace(path: Path, data: bytes) -> None:
    partial = path.with_name(f"{path.name}.partial")
    partial.write_bytes(data)
    partial.replace(path)


def _still(path: Path) -> Still:
    with np.load(path) as data:
        board = BoardView(data["ids"], data["points_m"], data["pixels"])
        t_s, delay_s = data["stamps"]
        view = PosedView(board, data["T_base_tool"])
    image = cv2.imread(str(path.with_suffix(".png")), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise OSError(f"{path.with_suffix('.png')} is missing or damaged")
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
