"""The grab loop: opens, sets up, measures, stamps, notices failures and opens again.

It owns no thread and never blocks longer than the device's own timeout, so that all of it runs
on simulated time in a test; ``OpenCvCamera`` steps it from a thread.
"""

from collections.abc import Callable
from typing import Literal

from drivers.camera.backoff import Backoff
from drivers.camera.counting import ExposureCounter, RateMeter
from drivers.camera.device import CameraLost, Grab, Mode, VideoDevice
from drivers.camera.frozen import FrozenCheck
from drivers.camera.health import CameraHealth, Status
from drivers.camera.newest import NewestFrame
from drivers.camera.settings import CameraSettings
from drivers.camera.setup import SetUp, set_up
from drivers.camera.stamps import Stamper
from drivers.clock import Clock
from drivers.errors import ConnectError
from drivers.interfaces import Frame

_NOMINAL_RATE_HZ = 30.0
_BACKOFF_SLICE_S = 0.1  # so that closing is prompt
_MAX_BAD_IN_A_ROW = 10  # then opening again is worth the gap


class Grabber:
    """Keeps one camera delivering into ``newest``."""

    def __init__(
        self,
        open_device: Callable[[], VideoDevice],
        settings: CameraSettings,
        clock: Clock,
        newest: NewestFrame,
        access: str,
    ) -> None:
        self._open_device = open_device
        self._settings = settings
        self._clock = clock
        self._newest = newest
        self._where = str(settings.source)
        self._status = Status(clock, self._where, access)
        self._period_s = 1.0 / (settings.rate_hz or _NOMINAL_RATE_HZ)
        self._stamper = Stamper(
            self._period_s, settings.max_age_s, settings.transfer_s, settings.assumed_exposure_s
        )
        self._counter = ExposureCounter(self._period_s)
        self._backoff = Backoff(
            settings.first_backoff_s, settings.max_backoff_s, settings.give_up_after_s
        )
        self._device: VideoDevice | None = None
        self._set_up = SetUp(Mode(), None, ())
        self._frozen = FrozenCheck(settings.max_identical)
        self._meter: RateMeter | None = None
        self._delivering = False

    def open(self) -> None:
        """Open, set up and measure; raises ConnectError when any of it fails."""
        self._start()
        try:
            while self._device is not None and self._meter is not None:
                self._take(self._device, self._device.grab())
        except CameraLost as error:
            self.close()
            raise ConnectError(f"camera {self._where}: {error}") from error
        except BaseException:
            self.close()
            raise
        # Nobody reads before this: those frames only told the rate.
        self._delivering = True

    def step(self) -> None:
        """One grab, or one slice of the wait to open again; does nothing once failed or closed."""
        if self._status.state in ("failed", "closed"):
            return
        try:
            if self._device is None:
                self._try_again()
            else:
                self._take(self._device, self._device.grab())
        except CameraLost as error:
            self._lose(str(error))

    def fail(self, words: str) -> None:
        """Give up for good: say why, and let go of the device."""
        self._status.trouble("failed", words)
        self._newest.end()
        self._release()

    def close(self) -> None:
        """Let go of the device; harmless when repeated."""
        self._status.closed()
        self._newest.end()
        self._release()

    @property
    def failed(self) -> str | None:
        """Why no frame will come any more; None while there is hope."""
        return self._status.problem if self._status.state == "failed" else None

    @property
    def period_s(self) -> float:
        """The frame period, measured where it was measured."""
        return self._period_s

    def health(self) -> CameraHealth:
        """A snapshot, from any thread."""
        return self._status.health(self._period_s, self._counter.dropped)

    def _start(self) -> None:
        """Open and set up; on failure nothing stays open."""
        settings = self._settings
        device = self._open_device()
        try:
            self._set_up = set_up(device, settings, self._where)
        except BaseException:
            device.release()
            raise
        self._device = device
        self._use_period(self._set_up.mode.rate_hz)
        measured = settings.rate_check_s > 0
        # The first buffers are filled while the device settles.
        self._meter = RateMeter(settings.rate_check_s, settings.buffers) if measured else None
        self._status.opened(self._set_up.mode, self._set_up.warnings)

    def _take(self, device: VideoDevice, grab: Grab) -> None:
        if grab.image is None:
            self._bad("corrupt", "a damaged picture was delivered")
            return
        stamp = self._stamper.stamp(
            grab, device.stamp_source, device.stamps_mid_exposure, self._set_up.exposure_s
        )
        if isinstance(stamp, str):
            self._bad("refused", stamp)
            return
        t_s, own_stamp = stamp.t_exposure_mid_s, stamp.source == device.stamp_source
        # A sender that tells when it exposed vouches for its picture; a synthetic one has no noise.
        if not (own_stamp and device.stamps_mid_exposure):
            self._frozen.check(grab.image)
        seq = self._counter.next(t_s, grab.sequence, own_stamp)
        self._status.frame(grab.returned_s, stamp.source)
        if self._meter is not None:
            self._measure(t_s, self._meter)
        else:
            self._status.well()
            self._backoff.over()
        if self._delivering:
            self._newest.put(Frame(grab.image, t_s, stamp.exposure_s, seq, stamp.source))

    def _measure(self, t_s: float, meter: RateMeter) -> None:
        meter.add(t_s)
        rate_hz = meter.rate_hz
        if not meter.done or rate_hz is None:
            return
        self._meter = None
        self._use_period(rate_hz)
        wanted = self._settings.rate_hz
        if wanted is None or abs(rate_hz - wanted) <= self._settings.rate_tolerance * wanted:
            self._status.measured(rate_hz, ())
            return
        span_s = self._settings.rate_check_s
        words = f"{wanted:g} fps requested, {rate_hz:.2f} measured over {span_s:g} s"
        if "rate" not in self._settings.optional:
            raise CameraLost(f"{words}: shorten the exposure, or use a faster port or fourcc")
        self._status.measured(rate_hz, (words,))

    def _use_period(self, rate_hz: float | None) -> None:
        if rate_hz:
            self._period_s = 1.0 / rate_hz
            self._stamper.use_period(self._period_s)
            self._counter.use_period(self._period_s)

    def _bad(self, kind: Literal["corrupt", "refused"], words: str) -> None:
        self._status.bad(kind, words)
        if self._status.bad_in_a_row >= _MAX_BAD_IN_A_ROW:
            raise CameraLost(f"{words}, {_MAX_BAD_IN_A_ROW} times in a row")
        limit_s = self._settings.select_timeout_s
        if self._clock.now_s() - self._status.last_arrival_s > limit_s:
            raise CameraLost(f"{words}; no new one for {limit_s} s")

    def _lose(self, words: str) -> None:
        self._status.trouble("reopening", words)
        self._release()
        self._plan_retry()

    def _plan_retry(self) -> None:
        outage_s = self._backoff.failed(self._clock.now_s())
        if outage_s is not None:
            self.fail(f"given up after {outage_s:.1f} s: {self._status.problem}")

    def _try_again(self) -> None:
        now_s = self._clock.now_s()
        if now_s < self._backoff.retry_at_s:
            self._clock.sleep_until(min(self._backoff.retry_at_s, now_s + _BACKOFF_SLICE_S))
            return
        try:
            self._start()
        except ConnectError as error:
            self._status.trouble("reopening", str(error))
            self._plan_retry()
            return
        self._counter.reopened()

    def _release(self) -> None:
        device, self._device = self._device, None
        self._meter = None
        if device is not None:
            device.release()
