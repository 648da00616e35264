"""What goes on with a camera, in words and numbers."""

import threading
from dataclasses import dataclass, field
from typing import Literal

from drivers.camera.device import Mode
from drivers.clock import Clock

State = Literal["streaming", "stalled", "reopening", "failed", "closed"]

_STALLED_PERIODS = 2.0
_STALLED_LEAST_S = 0.1  # a busy machine delays a frame by tens of milliseconds now and then


@dataclass(frozen=True, slots=True)
class CameraHealth:
    """A snapshot of a camera's condition."""

    source: str
    access: str  # which mechanism delivers: "opencv", "linuxpy", "mjpeg", "replay"
    state: State
    problem: str | None = None  # the newest one, in words; None while all is well
    mode: Mode = field(default_factory=Mode)
    measured_rate_hz: float | None = None  # at the last opening
    stamp_source: str | None = None  # of the newest frame
    frames: int = 0  # new exposures received
    dropped: int = 0  # exposures that left a gap, damaged ones included
    corrupt: int = 0  # bad or undecodable buffers
    refused: int = 0  # pictures that were not a new exposure
    reopened: int = 0
    last_frame_age_s: float | None = None  # since its arrival
    warnings: tuple[str, ...] = ()


class Status:
    """Collects a live camera's condition in the grab thread, for any thread to look at."""

    def __init__(self, clock: Clock, source: str, access: str) -> None:
        self._clock = clock
        self._source = source
        self._access = access
        self._lock = threading.Lock()
        self._state: State = "reopening"
        self._problem: str | None = None
        self._mode = Mode()
        self._warnings: tuple[str, ...] = ()
        self._rate_hz: float | None = None
        self._stamp_source: str | None = None
        self._frames = self._corrupt = self._refused = self._openings = 0
        self.bad_in_a_row = 0
        self.last_arrival_s = clock.now_s()

    @property
    def state(self) -> State:
        """The state, without looking at how old the newest frame is."""
        return self._state

    @property
    def problem(self) -> str | None:
        """The newest problem in words."""
        return self._problem

    def opened(self, mode: Mode, warnings: tuple[str, ...]) -> None:
        """The device is open and set up."""
        with self._lock:
            self._state, self._mode, self._warnings = "streaming", mode, warnings
            self._openings += 1
            self.bad_in_a_row = 0
            self.last_arrival_s = self._clock.now_s()

    def measured(self, rate_hz: float, warnings: tuple[str, ...]) -> None:
        """The rate is known; ``warnings`` come on top of those of the set-up."""
        with self._lock:
            self._rate_hz = rate_hz
            self._warnings += warnings

    def frame(self, returned_s: float, stamp_source: str) -> None:
        """A new exposure arrived."""
        with self._lock:
            self._frames += 1
            self.bad_in_a_row = 0
            self.last_arrival_s, self._stamp_source = returned_s, stamp_source

    def bad(self, kind: Literal["corrupt", "refused"], words: str) -> None:
        """Something arrived that is no new exposure."""
        with self._lock:
            if kind == "corrupt":
                self._corrupt += 1
            else:
                self._refused += 1
            self.bad_in_a_row += 1
            self._problem = words

    def well(self) -> None:
        """What was wrong is over."""
        with self._lock:
            self._problem = None

    def trouble(self, state: State, words: str) -> None:
        """The camera does not deliver; a closed one stays closed."""
        with self._lock:
            if self._state != "closed":
                self._state, self._problem = state, words

    def closed(self) -> None:
        """The user is done with the camera."""
        with self._lock:
            self._state = "closed"

    def health(self, period_s: float, dropped: int) -> CameraHealth:
        """A snapshot; a grab that blocks right now shows as stalled."""
        with self._lock:
            age_s = self._clock.now_s() - self.last_arrival_s
            state, problem = self._state, self._problem
            if state == "streaming" and age_s > max(_STALLED_PERIODS * period_s, _STALLED_LEAST_S):
                state, problem = "stalled", f"no frame for {age_s:.2f} s"
            return CameraHealth(
                source=self._source,
                access=self._access,
                state=state,
                problem=problem,
                mode=self._mode,
                measured_rate_hz=self._rate_hz,
                stamp_source=self._stamp_source,
                frames=self._frames,
                dropped=dropped,
                corrupt=self._corrupt,
                refused=self._refused,
                reopened=max(0, self._openings - 1),
                last_frame_age_s=age_s if self._frames else None,
                warnings=self._warnings,
            )
