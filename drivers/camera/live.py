"""A live camera: one thread grabs all the time, a reader gets the newest frame."""

import threading
from collections.abc import Callable

from drivers.camera.device import VideoDevice
from drivers.camera.grabber import Grabber
from drivers.camera.health import CameraHealth
from drivers.camera.newest import NewestFrame
from drivers.camera.settings import CameraSettings
from drivers.camera.source import SourceKind, parse_source
from drivers.clock import Clock
from drivers.errors import OperateError
from drivers.interfaces import Frame

_CLOSE_MARGIN_S = 1.0


class OpenCvCamera:
    """A V4L2 device or network stream behind the ``Camera`` interface.

    Opening takes ``rate_check_s``: the achieved frame rate is measured. ``clock`` must be the
    machine's monotonic clock, which the kernel's stamps are on. Raises ConnectError when the
    source cannot be opened, set up, or delivers at another rate than requested.
    """

    def __init__(
        self,
        settings: CameraSettings,
        clock: Clock,
        open_device: Callable[[], VideoDevice] | None = None,
    ) -> None:
        self._settings = settings
        self._clock = clock
        # A kernel stamp marks the arrival; without the transfer time its offset is a guess.
        exact = ("kernel", "stream") if settings.transfer_s > 0 else ("stream",)
        self._newest = NewestFrame(clock, settings.max_age_s, exact)
        opener, access = (open_device, "given") if open_device else _opener(settings, clock)
        self._grabber = Grabber(opener, settings, clock, self._newest, access)
        self._grabber.open()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._work, name="camera", daemon=True)
        self._thread.start()

    def read(self, timeout_s: float) -> Frame | None:
        """The newest frame not returned before; see ``drivers.interfaces.Camera``."""
        return self._read(-float("inf"), timeout_s)

    def read_after(self, t_s: float, timeout_s: float) -> Frame | None:
        """The newest frame whose exposure began after ``t_s``; None when none comes in time.

        Raises OperateError like ``read``.
        """
        return self._read(t_s, timeout_s)

    def health(self) -> CameraHealth:
        """What goes on: state, problem in words, rates and counts."""
        return self._grabber.health()

    def close(self) -> None:
        """Release the device; waits for the grab under way, harmless when repeated."""
        self._closing.set()
        self._newest.end()
        if self._thread is not threading.current_thread():
            self._thread.join(self._settings.select_timeout_s + _CLOSE_MARGIN_S)

    def _read(self, after_s: float, timeout_s: float) -> Frame | None:
        deadline_s = self._clock.now_s() + timeout_s
        while True:
            if self._closing.is_set():
                raise OperateError(f"camera {self._settings.source}: read after close")
            puts = self._newest.puts
            frame = self._newest.take(after_s, self._grabber.period_s)
            if frame is not None:
                return frame
            failed = self._grabber.failed
            if failed is not None:
                raise OperateError(
                    f"camera {self._settings.source} failed: {failed}. "
                    "Check its cable and `rig camera list`, then start again"
                )
            remaining_s = deadline_s - self._clock.now_s()
            if remaining_s <= 0:
                return None
            self._newest.wait(puts, remaining_s)

    def _work(self) -> None:
        try:
            while not self._closing.is_set() and self._grabber.failed is None:
                self._grabber.step()
        except BaseException as error:
            # A fault of this program: the reader must hear of it, or it would wait for ever.
            self._grabber.fail(f"internal error: {error!r}")
            raise
        finally:
            self._end()

    def _end(self) -> None:
        if self._closing.is_set():
            self._grabber.close()


def _opener(settings: CameraSettings, clock: Clock) -> tuple[Callable[[], VideoDevice], str]:
    """How to open this source, again and again, and the mechanism's name."""
    source = parse_source(settings.source)
    timeout_s = settings.select_timeout_s
    if source.kind is SourceKind.MJPEG:
        from drivers.camera.mjpeg_device import MjpegDevice

        return (lambda: MjpegDevice(source.address, clock, timeout_s)), "mjpeg"
    from drivers.camera.linuxpy_device import LinuxpyDevice, linuxpy_wanted

    if source.kind is SourceKind.DEVICE and linuxpy_wanted(settings.access):
        return (lambda: LinuxpyDevice(source.address, clock, timeout_s)), "linuxpy"
    from drivers.camera.opencv_device import OpenCvDevice

    return (lambda: OpenCvDevice(source, clock, timeout_s)), "opencv"
