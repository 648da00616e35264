"""What the control loop writes to: one call a record, none of which waits for a disk."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from drivers.clock import Clock
from drivers.errors import ConfigError
from drivers.interfaces import ArmState
from estimator.estimate import Estimate
from rig.log.encode import Encoder
from rig.log.entry import Attached, Commanded, Estimated, Happened, Picture, Seen, States, Ticked
from rig.log.header import LogHeader, attachments_of, metadata_of
from rig.log.mcap_file import McapFile
from rig.log.recorder import Recorded, Recorder, warn_on_stderr
from rig.vision import Sighting

LOG_NAME = "log.mcap"


class RunLog:
    """Every sample of a run, stamped with the instant it was true and the instant it came here.

    Instants come from the run's clock, so that on simulated time the same seed writes the same
    bytes.
    """

    def __init__(self, recorder: Recorder, clock: Clock, images: bool) -> None:
        self._recorder = recorder
        self._clock = clock
        self._images = images
        self._reads = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> Recorded:
        """Write what is left; harmless when repeated."""
        return self._recorder.close()

    def states(self, states: Sequence[ArmState]) -> None:
        """Arm samples that were read at once."""
        self._reads += 1
        self._recorder.put(States(tuple(states), self._reads), self._clock.now_s())

    def frame(self, sighting: Sighting, handled_s: float) -> None:
        """One received image: its stamp, when it was handled, what was measured in it."""
        now_s = self._clock.now_s()
        self._recorder.put(Seen(sighting, handled_s), now_s)
        if self._images:
            self._recorder.put(Picture(sighting.frame), now_s)

    def tick(self, t_s: float, late_s: float, overruns: int) -> None:
        """One tick: all that came in before it is used by it."""
        self._recorder.put(Ticked(t_s, late_s, overruns), self._clock.now_s())

    def estimate(self, kind: str, estimate: Estimate) -> None:
        """The state after an image (``kind`` update) or predicted to a tick (estimate)."""
        self._recorder.put(Estimated(kind, estimate), self._clock.now_s())

    def command(
        self,
        t_s: float,
        commanded: np.ndarray,
        allowed: np.ndarray,
        measured: np.ndarray,
        reasons: Sequence[str],
    ) -> None:
        """One tick's tool twists: asked for, allowed (with the reasons for any cut), measured."""
        entry = Commanded(t_s, commanded, allowed, measured, tuple(reasons))
        self._recorder.put(entry, self._clock.now_s())

    def event(self, t_s: float, name: str, detail: str = "") -> None:
        """Something that happened: started, target lost, stopped, …"""
        self._recorder.put(Happened(t_s, name, detail), self._clock.now_s())

    def attach(self, path: Path) -> None:
        """A file that came of what was recorded; one that cannot be read is left out."""
        with suppress(OSError):
            self._recorder.put(Attached(path.name, path.read_bytes()), self._clock.now_s())


def open_run_log(
    run_dir: Path,
    header: LogHeader,
    clock: Clock,
    warn: Callable[[str], None] = warn_on_stderr,
) -> RunLog:
    """Begin ``log.mcap`` in the run directory; raises ConfigError when it cannot be written."""
    return open_log_file(run_dir / LOG_NAME, header, clock, warn)


def open_log_file(
    path: Path, header: LogHeader, clock: Clock, warn: Callable[[str], None] = warn_on_stderr
) -> RunLog:
    """Begin a log; raises ConfigError when it cannot be written."""
    images = header.config.log
    encoder = Encoder(images, header.intrinsics, header.T_tool_camera, header.offset_ns)
    now_ns = encoder.ns(clock.now_s())
    try:
        file = McapFile(path, path.open("wb"))
        for name, values in metadata_of(header).items():
            file.metadata(name, values)
        for name, data in attachments_of(header).items():
            file.attach(name, data, now_ns)
        file.flush()
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {error}") from error
    recorder = Recorder(file, encoder, clock if header.realtime else None, warn)
    return RunLog(recorder, clock, images.images != "off" and header.pictures)
