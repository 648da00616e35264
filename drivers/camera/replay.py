"""A recording behind the ``Camera`` interface, played at its frame rate on any clock."""

import math

from drivers.camera.device import Mode
from drivers.camera.health import CameraHealth, State
from drivers.camera.recordings import open_recording
from drivers.camera.settings import CameraSettings
from drivers.camera.setup import errors_or_warnings, mode_misses
from drivers.camera.source import parse_source
from drivers.clock import Clock
from drivers.errors import ConnectError, OperateError
from drivers.interfaces import Frame

_DEFAULT_RATE_HZ = 30.0
# A frame is due at its instant; a clock may be a rounding error before it.
_EPSILON = 1e-6


class ReplayCamera:
    """A video file or image folder; its first frame is exposed at the first read.

    Frames come at ``settings.rate_hz``, else at the recording's own rate, else at 30 per second,
    and are stamped with the instants of that grid (``stamp_source: replay``). Frames nobody
    reads in time are skipped, as with a live camera. Without ``loop`` reading past the end is
    an OperateError.
    """

    def __init__(self, settings: CameraSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._recording = open_recording(parse_source(settings.source))
        self._period_s = 1.0 / (settings.rate_hz or self._recording.rate_hz or _DEFAULT_RATE_HZ)
        told_ms = settings.controls.exposure_ms
        self._exposure_s = settings.assumed_exposure_s if told_ms is None else told_ms / 1e3
        self._start_s: float | None = None
        self._last = -1
        self._frames = 0
        self._closed = False
        try:
            height, width = self._recording.image(0).shape
            self._mode = Mode(width, height, 1.0 / self._period_s)
            self._warnings = self._size_warnings(width, height)
        except OperateError as error:
            self._recording.close()
            raise ConnectError(str(error)) from error
        except ConnectError:
            self._recording.close()
            raise

    def read(self, timeout_s: float) -> Frame | None:
        """The newest frame not returned before; see ``drivers.interfaces.Camera``."""
        return self._read(0, timeout_s)

    def read_after(self, t_s: float, timeout_s: float) -> Frame | None:
        """The newest frame whose exposure began at ``t_s`` or later; None if none comes in time.

        A recording that was not read before begins then.
        """
        mid_s = t_s + self._exposure_s / 2
        if self._start_s is None:
            self._start_s = max(self._clock.now_s(), mid_s)
        first = math.ceil((mid_s - self._start_s) / self._period_s - _EPSILON)
        return self._read(max(0, first), timeout_s)

    def health(self) -> CameraHealth:
        """What goes on."""
        state: State = "closed" if self._closed else "streaming"
        return CameraHealth(
            source=str(self._settings.source),
            access="replay",
            state=state,
            mode=self._mode,
            measured_rate_hz=1.0 / self._period_s,
            stamp_source="replay",
            frames=self._frames,
            dropped=max(0, self._last + 1 - self._frames),
            warnings=self._warnings,
        )

    def close(self) -> None:
        """Close the recording; harmless when repeated."""
        self._closed = True
        self._recording.close()

    def _read(self, first: int, timeout_s: float) -> Frame | None:
        if self._closed:
            raise OperateError(f"camera {self._settings.source}: read after close")
        now_s = self._clock.now_s()
        if self._start_s is None:
            self._start_s = now_s
        deadline_s = now_s + timeout_s
        wanted = max(first, self._last + 1)
        due_s = self._start_s + wanted * self._period_s
        if self._newest() < wanted:
            if not self._settings.loop and wanted >= self._recording.count:
                self._ended()
            self._clock.sleep_until(min(due_s, deadline_s))
        newest = self._newest()
        if not self._settings.loop:
            newest = min(newest, self._recording.count - 1)
            if newest < wanted and self._newest() > newest:
                self._ended()
        return self._take(newest) if newest >= wanted else None

    def _newest(self) -> int:
        start_s = self._start_s or 0.0
        return math.floor((self._clock.now_s() - start_s) / self._period_s + _EPSILON)

    def _take(self, index: int) -> Frame:
        image = self._recording.image(index % self._recording.count)
        if image.shape != (self._mode.height, self._mode.width):
            raise OperateError(f"{self._settings.source}: picture {index} has another size")
        self._last = index
        self._frames += 1
        t_s = (self._start_s or 0.0) + index * self._period_s
        return Frame(image, t_s, self._exposure_s, index, "replay")

    def _ended(self) -> None:
        raise OperateError(
            f"{self._settings.source} has ended after {self._recording.count} pictures; "
            "set loop: true to start again"
        )

    def _size_warnings(self, width: int, height: int) -> tuple[str, ...]:
        """Rate and format are the recording's own business, its size is that of the images."""
        requested = Mode(self._settings.width, self._settings.height)
        misses = mode_misses(requested, Mode(width, height), self._settings.rate_tolerance)
        return errors_or_warnings(misses, self._settings, str(self._settings.source))
