"""Measures what a camera really delivers over some seconds."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.camera.health import CameraHealth
from drivers.camera.open import WatchedCamera
from drivers.clock import Clock
from drivers.errors import OperateError
from drivers.interfaces import Frame

_LATENCY_KNOWN = ("kernel", "stream")  # stamps made on arrival or by a grid tell no latency
_READ_TIMEOUT_S = 0.5


@dataclass(frozen=True, slots=True)
class CameraCheck:
    """What was seen; None where it cannot be known."""

    health: CameraHealth
    frames: int
    lasted_s: float
    rate_hz: float | None  # from the stamps and the exposures counted, dropped ones included
    stamp_jitter_s: float | None  # rms of the stamps about an even grid
    longest_gap_s: float | None  # between two frames read
    latency_median_s: float | None  # from mid-exposure to the reader
    latency_p99_s: float | None
    dropped: int
    exposure_s: float | None
    problem: str | None


def check_camera(camera: WatchedCamera, clock: Clock, duration_s: float) -> CameraCheck:
    """Read for ``duration_s`` as a control loop would, and sum up; a failure is in ``problem``."""
    start_s = clock.now_s()
    before = camera.health()
    frames: list[Frame] = []
    latencies: list[float] = []
    problem: str | None = None
    while (left_s := start_s + duration_s - clock.now_s()) > 0:
        try:
            frame = camera.read(min(_READ_TIMEOUT_S, left_s))
        except OperateError as error:
            problem = str(error)
            break
        now_s = clock.now_s()
        health = camera.health()
        problem = problem or health.problem
        if frame is not None:
            latencies.append(now_s - frame.t_exposure_mid_s)
            frames.append(frame)
    health = camera.health()
    known = bool(frames) and all(frame.stamp_source in _LATENCY_KNOWN for frame in frames)
    stamps_s = np.array([frame.t_exposure_mid_s for frame in frames])
    rate_hz, jitter_s = _grid(stamps_s, np.array([frame.seq for frame in frames]))
    return CameraCheck(
        health=health,
        frames=len(frames),
        lasted_s=clock.now_s() - start_s,
        rate_hz=rate_hz,
        stamp_jitter_s=jitter_s,
        longest_gap_s=float(np.diff(stamps_s).max()) if len(frames) > 1 else None,
        latency_median_s=float(np.median(latencies)) if known else None,
        latency_p99_s=float(np.percentile(latencies, 99)) if known else None,
        dropped=health.dropped - before.dropped,
        exposure_s=frames[-1].exposure_s if frames else None,
        problem=problem or (None if frames else "no frame came"),
    )


def _grid(
    stamps_s: NDArray[np.float64], seqs: NDArray[np.int64]
) -> tuple[float | None, float | None]:
    """Rate and rms residual of the even grid that fits the stamps best."""
    if len(stamps_s) < 3:
        return None, None
    period_s, first_s = np.polyfit(seqs - seqs[0], stamps_s - stamps_s[0], 1)
    residual_s = stamps_s - stamps_s[0] - first_s - period_s * (seqs - seqs[0])
    rms_s = float(np.sqrt(np.mean(residual_s**2)))
    return (float(1.0 / period_s) if period_s > 0 else None), rms_s
