"""The camera's measured twist over the recent past, piecewise linear in time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimator.jit import jit, jit_template

FloatArray = NDArray[np.float64]

_FIRST_CAPACITY = 1024


class MotionUnknownError(LookupError):
    """The motion was asked for at an instant too far outside the recorded span."""


@dataclass(frozen=True, slots=True)
class TwistSample:
    """The twist at one instant."""

    t_s: float
    twist_camera: FloatArray  # (6,) v, ω
    extrapolated_s: float  # distance to the nearest recorded instant; 0 inside the span


@dataclass(frozen=True, slots=True)
class TwistWindow:
    """The piecewise-linear twist over an interval: its end points and every stamp between."""

    times_s: FloatArray  # (n,) increasing
    twists_camera: FloatArray  # (n, 6) v, ω
    extrapolated_s: float  # how far the interval reaches beyond the recorded span; 0 inside


class TwistHistory:
    """Measured camera twists (v, ω) at the arm's own stamps, interpolated linearly between.

    Keeps at least the last ``span_s`` seconds. Up to ``max_extrapolation_s`` outside the
    recorded span the nearest sample is held and the answer says so; further out every
    question raises MotionUnknownError.
    """

    def __init__(self, span_s: float = 5.0, max_extrapolation_s: float = 0.02) -> None:
        if not span_s > 0.0 or not max_extrapolation_s >= 0.0:
            raise ValueError("span_s must be positive and max_extrapolation_s not negative")
        self._span_s = span_s
        self._max_extrapolation_s = max_extrapolation_s
        self._times_s = np.empty(_FIRST_CAPACITY)
        self._twists = np.empty((_FIRST_CAPACITY, 6))
        self._first = 0
        self._end = 0
        # Covariance (6, 6) of a recorded twist; None: nobody said how uncertain they are.
        self.covariance: FloatArray | None = None
        # Spectral density (6, 6) of its error; None: that of independent samples.
        self.density: FloatArray | None = None
        # Compiles the kernel now rather than in the middle of a run.
        _cut(np.zeros(1), np.zeros((1, 6)), 0, 1, 0.0, 0.0)

    def __len__(self) -> int:
        return self._end - self._first

    @property
    def start_s(self) -> float:
        """The oldest recorded instant; raises MotionUnknownError while empty."""
        self._require_samples()
        return float(self._times_s[self._first])

    @property
    def end_s(self) -> float:
        """The newest recorded instant; raises MotionUnknownError while empty."""
        self._require_samples()
        return float(self._times_s[self._end - 1])

    @property
    def sample_s(self) -> float:
        """The mean time from one kept sample to the next; 0 for fewer than two."""
        return (self.end_s - self.start_s) / (len(self) - 1) if len(self) > 1 else 0.0

    def spectrum(self, unknown: FloatArray) -> FloatArray:
        """Spectral density (6, 6) of the twist's error: times a duration, the covariance of the
        motion integrated over it. ``unknown`` (6, 6) is a twist's covariance where nobody said."""
        if self.density is not None:
            return self.density
        covariance = unknown if self.covariance is None else self.covariance
        return covariance * self.sample_s

    def append(self, t_s: float, twist_camera: ArrayLike) -> None:
        """Record one twist (6,); raises ValueError unless ``t_s`` is later than all before."""
        self.extend([t_s], np.asarray(twist_camera, dtype=float)[None])

    def extend(self, times_s: ArrayLike, twists_camera: ArrayLike) -> None:
        """Record twists (n, 6) at strictly increasing instants (n,), all or none of them.

        Raises ValueError on a stamp that does not increase, a wrong shape, or a non-number.
        """
        times = np.asarray(times_s, dtype=float)
        twists = np.asarray(twists_camera, dtype=float)
        if times.ndim != 1 or twists.shape != (times.size, 6):
            raise ValueError(f"expected times (n,), twists (n, 6): {times.shape}, {twists.shape}")
        if not (np.isfinite(times).all() and np.isfinite(twists).all()):
            raise ValueError("a twist or its stamp is not a finite number")
        if times.size == 0:
            return
        if np.any(times[1:] <= times[:-1]) or (len(self) and times[0] <= self.end_s):
            raise ValueError(f"twist stamps must increase: {times[0]:.6f} s came too late")
        self._make_room(times.size)
        self._times_s[self._end : self._end + times.size] = times
        self._twists[self._end : self._end + times.size] = twists
        self._end += times.size
        self._forget()

    def covers(self, t_s: float) -> bool:
        """Whether the twist at ``t_s`` is known, if need be by the allowed extrapolation."""
        return len(self) > 0 and self._outside_s(t_s) <= self._max_extrapolation_s

    def at(self, t_s: float) -> TwistSample:
        """The twist at one instant; raises MotionUnknownError where it is not known."""
        outside_s = self._checked_outside_s(t_s)
        return TwistSample(t_s, self._cut(t_s, t_s)[1][0], outside_s)

    def window(self, t0_s: float, t1_s: float) -> TwistWindow:
        """The twist over [t0_s, t1_s], end points included.

        Raises ValueError unless ``t0_s <= t1_s``, and MotionUnknownError where the motion is
        not known.
        """
        if not t0_s <= t1_s:
            raise ValueError(f"the interval [{t0_s:.6f}, {t1_s:.6f}] s runs backwards")
        outside_s = max(self._checked_outside_s(t0_s), self._checked_outside_s(t1_s))
        return TwistWindow(*self._cut(t0_s, t1_s), outside_s)

    def _cut(self, t0_s: float, t1_s: float) -> tuple[FloatArray, FloatArray]:
        return _cut(self._times_s, self._twists, self._first, self._end, float(t0_s), float(t1_s))

    def _outside_s(self, t_s: float) -> float:
        return max(self.start_s - t_s, t_s - self.end_s, 0.0)

    def _checked_outside_s(self, t_s: float) -> float:
        self._require_samples()
        outside_s = self._outside_s(t_s)
        if not outside_s <= self._max_extrapolation_s:
            raise MotionUnknownError(
                f"the arm's motion at {t_s:.6f} s is not known: recorded from {self.start_s:.6f} "
                f"to {self.end_s:.6f} s, extrapolated by {self._max_extrapolation_s:g} s at most"
            )
        return outside_s

    def _require_samples(self) -> None:
        if self._end == self._first:
            raise MotionUnknownError("no twist of the arm has been recorded yet")

    def _make_room(self, count: int) -> None:
        """Ensure space for ``count`` more rows, moving the kept ones to the front at times.

        The capacity is at least twice what is kept, so a row is moved about once in its life.
        """
        if self._end + count <= self._times_s.size:
            return
        kept = slice(self._first, self._end)
        capacity = max(_FIRST_CAPACITY, 2 * (len(self) + count))
        times, twists = np.empty(capacity), np.empty((capacity, 6))
        times[: len(self)], twists[: len(self)] = self._times_s[kept], self._twists[kept]
        self._times_s, self._twists = times, twists
        self._first, self._end = 0, len(self)

    def _forget(self) -> None:
        """Drop what is older than the span, keeping one sample at or before its start."""
        stamps = self._times_s[self._first : self._end]
        older = int(np.searchsorted(stamps, self.end_s - self._span_s, side="right"))
        self._first += max(older - 1, 0)


@jit
def _cut(
    times_s: FloatArray, twists: FloatArray, first: int, end: int, t0_s: float, t1_s: float
) -> tuple[FloatArray, FloatArray]:
    """Of the rows [first, end): both ends and every stamp strictly between; one row if t0 = t1."""
    low, high = first, end
    while low < high:  # ends at the first stamp later than t0
        middle = (low + high) // 2
        if times_s[middle] <= t0_s:
            low = middle + 1
        else:
            high = middle
    stop = low
    while stop < end and times_s[stop] < t1_s:
        stop += 1
    n = stop - low + (2 if t1_s > t0_s else 1)
    out_times_s, out = np.empty(n), np.empty((n, 6))
    out_times_s[0] = t0_s
    _interpolate(times_s, twists, first, end, low, t0_s, out[0])
    for k in range(low, stop):
        out_times_s[k - low + 1] = times_s[k]
        out[k - low + 1] = twists[k]
    if n > stop - low + 1:
        out_times_s[n - 1] = t1_s
        _interpolate(times_s, twists, first, end, stop, t1_s, out[n - 1])
    return out_times_s, out


@jit_template
def _interpolate(
    times_s: FloatArray,
    twists: FloatArray,
    first: int,
    end: int,
    after: int,
    t_s: float,
    out: FloatArray,
) -> None:
    """The twist (6,) at ``t_s`` into ``out``; ``after`` is the row that follows it, or ``end``."""
    # Before the first or after the last stamp both neighbours are the end sample.
    earlier, later = max(after - 1, first), min(after, end - 1)
    share = 0.0
    if earlier < later:
        share = (t_s - times_s[earlier]) / (times_s[later] - times_s[earlier])
    for j in range(6):
        out[j] = (1.0 - share) * twists[earlier, j] + share * twists[later, j]
