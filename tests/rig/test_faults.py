"""Every fault at random moments of a whole ``rig run``, measured at the controller.

The arm stops in time, the log is complete, exit status and message are right, nothing hangs and
nothing is left behind; afterwards the rig can be brought back and used again.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from rig.exit_codes import ExitCode
from tests.contract.arms import Motion
from tests.rig.loopback_run import CLOCK, ENDS_WITHIN_S, LoopbackRun, Result
from tests.rig.loopback_served import ArmKind, Served, moves, served
from tests.rig.stopping import RAMP_S, REACTION_S, WATCHDOG_S, Stops, assert_complete

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]

TRIES = 3
WATCHED_S = 2.5  # after the fault; the arm has stood for long by then

# What the run says about each fault of the arm: a regular expression.
UR = {
    "protective_stop": "protective stop",
    "emergency_stop": "emergency stop",
    "program_stop": "control program was stopped",
    "drop": "is lost|died",  # the vendor's code may die of it before it can report
    "stall": "has not reported|went silent",
}
GANTRY = {
    "alarm": "limit switch",
    "door": "door",
    "emergency_stop": "emergency stop",
    "reset": "reset",
    "stall": "has not answered|went silent",  # to the driver, or its states grew old first
    "drop": "is gone",
}
# A wedged controller cannot be told to stop: its watchdog does that, or its queue runs out.
DEAF = ("stall", "drop")
# Without a fresh image (safety.max_feature_age_s) the arm is brought to rest.
IMAGE_AGE_S = 0.3
CAMERA = ("camera_unplug", "camera_freeze")
# Opening again takes a busy host its time.
PATIENT = ("--set", "safety.target_lost_after_s=4.5")
ARM_FAULTS = [("ur", fault) for fault in UR] + [("grbl", fault) for fault in GANTRY]
CAMERA_FAULTS = [(arm, fault) for arm in ("ur", "grbl") for fault in CAMERA]


@pytest.fixture(scope="module")
def rig(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Served]:
    arm: ArmKind = request.param
    if arm == "ur":
        pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    with served(arm, tmp_path_factory.mktemp("rig"), for_s=3600.0) as running:
        yield running


@dataclass(frozen=True)
class Failed:
    """A run that met a fault at a random moment of its motion."""

    begun_s: float  # when the fault began
    motion: Motion  # of the tool from then on, for WATCHED_S
    result: Result

    def rest_s(self, until_s: float = float("inf")) -> float:
        """From the fault to the last motion before ``until_s``, at the controller."""
        moving = moves(self.motion) & (self.motion.t_s < until_s)
        return float(self.motion.t_s[moving].max()) - self.begun_s if moving.any() else 0.0


def failed(
    rig: Served, fault: str, for_s: float, seed: int, out: Path, extra: Sequence[str] = ()
) -> Failed:
    """Run, and let ``fault`` happen for ``for_s`` (0: until mended) while the arm moves.

    A run that a busy host has ended before the fault could begin measures nothing: once more.
    """
    for again in range(TRIES):
        failure = _failed_once(rig, fault, for_s, seed, out / str(again), extra)
        if failure.result.log[-1]["t_s"] > failure.begun_s:
            break
        print(f"{fault} {rig.arm}: disturbed, {failure.result.log[-1]['detail']!r}", flush=True)
        rig.mend()
    return failure


def _failed_once(
    rig: Served, fault: str, for_s: float, seed: int, out: Path, extra: Sequence[str]
) -> Failed:
    random = np.random.default_rng([seed, sum(fault.encode())])
    run = LoopbackRun(rig, out, seed, ["--json", "--duration", "5", *extra])
    try:
        run.wait_until_moving()
        CLOCK.sleep_until(CLOCK.now_s() + float(random.uniform(0.0, 0.8)))
        begun_s = CLOCK.now_s()
        rig.fault(fault, for_s)
        # The controller remembers ten seconds: look before the run has written its report.
        CLOCK.sleep_until(begun_s + WATCHED_S)
        motion = rig.motion(begun_s)
        return Failed(begun_s, motion, run.finish(ENDS_WITHIN_S))
    finally:
        run.kill()


@pytest.mark.parametrize(("rig", "fault"), ARM_FAULTS, indirect=["rig"])
def test_a_failing_arm_ends_the_run_at_rest_and_in_words(
    rig: Served, fault: str, seeds: range, tmp_path: Path
) -> None:
    stops = Stops(rig.arm, fault)
    words = (UR if rig.arm == "ur" else GANTRY)[fault]
    for seed in seeds:
        failure = failed(rig, fault, 0.0, seed, tmp_path / str(seed))
        result = failure.result
        stops.add(failure.rest_s(), result)
        rig.mend()
        assert result.exit_code == ExitCode.DEVICE, result.stderr
        assert_complete(result)
        assert result.summary is not None
        message = result.summary["error"]
        assert re.search(words, message), message
        assert result.stderr.count(f"error: {message}") == 1
    reaction_s = WATCHDOG_S[rig.arm] if fault in DEAF and rig.arm == "grbl" else REACTION_S
    stops.assert_within(reaction_s + RAMP_S[rig.arm])


@pytest.mark.parametrize(("rig", "fault"), CAMERA_FAULTS, indirect=["rig"])
def test_a_camera_gone_for_good_ends_the_run_at_rest_and_in_words(
    rig: Served, fault: str, seeds: range, tmp_path: Path
) -> None:
    stops = Stops(rig.arm, f"{fault} for good")
    for seed in seeds:
        failure = failed(rig, fault, 0.0, seed, tmp_path / str(seed))
        result = failure.result
        stops.add(failure.rest_s(), result)
        rig.mend()
        assert result.exit_code == ExitCode.DEVICE, result.stderr
        assert_complete(result)
        assert result.summary is not None
        assert "camera" in result.summary["error"]
        assert "state holding" in result.events()
    stops.assert_within(IMAGE_AGE_S + REACTION_S + RAMP_S[rig.arm])


@pytest.mark.parametrize(("rig", "fault"), CAMERA_FAULTS, indirect=["rig"])
def test_a_camera_gone_for_a_moment_is_waited_for_at_rest(
    rig: Served, fault: str, seeds: range, tmp_path: Path
) -> None:
    stops = Stops(rig.arm, f"{fault} for 0.8 s")
    for seed in seeds:
        failure = failed(rig, fault, 0.8, seed, tmp_path / str(seed), PATIENT)
        result = failure.result
        held = [line["t_s"] for line in result.log if line.get("event") == "state holding"]
        went_on = [line["t_s"] for line in result.log if line.get("event") == "state running"]
        assert max(held) > failure.begun_s, result.stderr
        assert max(went_on) > min(t_s for t_s in held if t_s > failure.begun_s)
        stops.add(failure.rest_s(min(t_s for t_s in went_on if t_s > failure.begun_s)), result)
        assert result.exit_code == ExitCode.OK, result.stderr
        assert_complete(result)
    stops.assert_within(IMAGE_AGE_S + REACTION_S + RAMP_S[rig.arm])
