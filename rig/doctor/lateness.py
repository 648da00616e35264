"""How late the control loop's ticks start on this machine, alone and beside vision."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from estimator.image.intrinsics import Intrinsics
from rig.config_devices import OpenCvCamera
from rig.doctor.finding import Finding, Status, Value
from rig.doctor.pictures import RATE_HZ, render_pictures
from rig.doctor.subject import Subject
from rig.realtime import control_conditions
from rig.schedule import TickStats, tick_grid
from rig.vision import Vision

FloatArray = NDArray[np.float64]

_WATCH_S = 10.0
_WATCH_QUICK_S = 2.0
_SETTLE_S = 0.5
_PUNCTUAL = 0.1  # share of the period that a tick may be late without anybody noticing
_FEWEST_PICTURES = 0.95


@dataclass(frozen=True, slots=True)
class LoopFacts:
    """A control grid as it was kept."""

    late_s: FloatArray  # (n,) start of each tick after its grid point
    overruns: int
    period_s: float
    hold_s: float  # the arm's: a command later than this finds it braking
    scheduling: str  # what the system granted


def idle(subject: Subject, clock: Clock) -> Finding:
    """The bare grid at the rig's control rate, under the conditions of a run."""
    facts = _keep_grid(subject, clock, _duration_s(subject), lambda: None)
    return judge_loop("loop_idle", facts, "")


def with_vision(subject: Subject, clock: Clock) -> Finding:
    """The same grid while the tracker measures 30 pictures a second, as in a run."""
    with tempfile.TemporaryDirectory(prefix="activerig-") as folder:
        vision = _vision(subject, folder, render_pictures(Path(folder)), clock)
        measured = lost = 0

        def take() -> None:
            nonlocal measured, lost
            for sighting in vision.poll():
                measured += 1
                lost += sighting.measurement.feature is None

        try:
            _keep_grid(subject, clock, _SETTLE_S, take)
            measured = lost = 0
            duration_s = _duration_s(subject)
            facts = _keep_grid(subject, clock, duration_s, take)
        finally:
            vision.close()
    return judge_vision(facts, measured / duration_s, lost)


def judge_loop(name: str, facts: LoopFacts, beside: str) -> Finding:
    """Late is what makes the arm brake by itself; a tenth of a period is what one may notice."""
    late_s = facts.late_s
    p99_s, longest_s = float(np.percentile(late_s, 99)), float(late_s.max())
    spare_s = facts.hold_s - facts.period_s
    braked = int(np.count_nonzero(late_s > spare_s))
    values: dict[str, Value] = {
        "rate_hz": 1.0 / facts.period_s,
        "ticks": len(late_s),
        "overruns": facts.overruns,
        "late_median_s": float(np.median(late_s)),
        "late_p99_s": p99_s,
        "late_max_s": longest_s,
        "braked": braked,
        "scheduling": facts.scheduling,
    }
    text = (
        f"late by {np.median(late_s) * 1e3:.2g} ms, p99 {p99_s * 1e3:.2g} ms, longest "
        f"{longest_s * 1e3:.2g} ms of {facts.period_s * 1e3:g}; {facts.overruns} of "
        f"{len(late_s)} ticks missed{beside} ({facts.scheduling})"
    )
    if p99_s > spare_s:
        why = f"a run would stutter: the arm brakes {facts.hold_s * 1e3:g} ms after a command"
        return Finding(name, Status.FAIL, text, f"{why}. {_advice(facts)}", values)
    if braked or p99_s > _PUNCTUAL * facts.period_s:
        return Finding(name, Status.WARN, text, _advice(facts), values)
    return Finding(name, Status.OK, text, "", values)


def _advice(facts: LoopFacts) -> str:
    first = "end other programs"
    if facts.scheduling == "normal":
        first += ", get real-time priority (row realtime priority)"
    return f"{first}; a PREEMPT_RT kernel helps further (row kernel)"


def judge_vision(facts: LoopFacts, rate_hz: float, lost: int) -> Finding:
    """As ``judge_loop``, and every picture has to be measured in its own time."""
    beside = f"; {rate_hz:.1f} of {RATE_HZ:g} pictures/s measured"
    finding = judge_loop("loop_vision", facts, beside)
    values = {**finding.values, "pictures_per_s": rate_hz, "pictures_lost": lost}
    status, advice = finding.status, finding.advice
    if rate_hz < _FEWEST_PICTURES * RATE_HZ and status is Status.OK:
        status, advice = Status.WARN, "a faster processor, or fewer or smaller images"
    return Finding(finding.name, status, finding.measured, advice, values)


def _vision(subject: Subject, folder: str, intrinsics: Intrinsics, clock: Clock) -> Vision:
    """What a run with a real camera uses, looking at the pictures in ``folder``."""
    from estimator.image.tracker import TargetTracker, warm_up
    from rig.build import open_camera
    from rig.vision.messages import Job
    from rig.vision.process import ProcessVision
    from rig.vision.threaded import ThreadedVision

    method = subject.config.camera.method
    pictures = OpenCvCamera(source=folder, rate_hz=RATE_HZ, loop=True, method=method)
    if subject.config.run.vision == "thread":
        warm_up("sphere", intrinsics, method)
        tracker = TargetTracker("sphere", intrinsics, method)
        return ThreadedVision(open_camera(pictures, clock), tracker)
    config = subject.config.model_copy(update={"camera": pictures})
    return ProcessVision(Job(config, "sphere", intrinsics), clock)


def _keep_grid(
    subject: Subject, clock: Clock, duration_s: float, work: Callable[[], None]
) -> LoopFacts:
    period_s = 1.0 / subject.config.run.control_rate_hz
    stats = TickStats()
    with control_conditions(subject.config.run.scheduling) as scheduling:
        end_s = clock.now_s() + duration_s
        for now_s in tick_grid(clock, period_s, stats):
            if now_s >= end_s:
                break
            work()
    hold_s = subject.config.arm.hold_s
    return LoopFacts(np.array(stats.late_s), stats.overruns, period_s, hold_s, scheduling)


def _duration_s(subject: Subject) -> float:
    return _WATCH_QUICK_S if subject.quick else _WATCH_S
