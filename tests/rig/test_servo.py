"""`rig run --servo`: the target comes to its place, and its radius is known when it is there."""

import json
from pathlib import Path

import numpy as np
import pytest

from rig.config import TargetKind
from rig.config_load import load_config
from rig.live import QuietView
from rig.outcome import Ending
from rig.run import RunResult, execute
from tests.rig.command_line import rig

FAST = ("sim.level=features", "log.images=off", "motion.policy=servo", "run.duration_s=9")


def servo(tmp_path: Path, target: TargetKind, *assignments: str, seed: int = 3) -> RunResult:
    config = load_config(target, None, [*FAST, f"sim.seed={seed}", *assignments])
    tmp_path.mkdir(exist_ok=True)
    return execute(config, target, tmp_path, False, QuietView(), lambda: False)


def number(result: RunResult, key: str) -> float:
    value = result.summary[key]
    assert isinstance(value, float)
    return value


STARTS: list[tuple[TargetKind, float, tuple[str, ...]]] = [
    ("sphere", 0.25, ()),
    ("sphere", 0.25, ("sim.sphere.start.distance_m=0.45",)),
    ("sphere", 0.25, ("sim.sphere.start.distance_m=0.16", "sim.sphere.start.tilt_y_deg=-30")),
    (
        *("sphere", 0.3),
        ("sim.sphere.start.offset_px=[200, -150]", "motion.servo.position_px=[200, 300]"),
    ),
    ("cylinder", 0.4, ("motion.servo.position_px=[380, 200]",)),
    ("cylinder", 0.3, ("sim.cylinder.start.distance_m=0.25",)),
]


@pytest.mark.parametrize(("target", "distance_m", "start"), STARTS)
def test_from_anywhere_the_target_comes_to_its_place_and_its_radius_is_known(
    target: TargetKind, distance_m: float, start: tuple[str, ...], tmp_path: Path
) -> None:
    result = servo(tmp_path, target, f"motion.servo.distance_m={distance_m}", *start)
    assert result.outcome.ending is Ending.CONVERGED
    assert number(result, "servo_error_px") < 2.0
    assert abs(number(result, "servo_distance_error_m")) < 0.001
    assert abs(number(result, "relative_error")) < 0.01
    last = result.outcome.data.updates[-1]
    truly_m = (float(np.linalg.norm(last.s)) - 1.0) * number(result, "radius_true_m")
    assert truly_m == pytest.approx(distance_m, abs=0.0015)


def test_where_the_task_leaves_nothing_to_do_the_null_space_is_what_finds_the_radius(
    tmp_path: Path,
) -> None:
    there = "sim.sphere.start.offset_px=[0, 0]"  # and at the wanted distance, but for 1 mm
    with_it = servo(tmp_path / "a", "sphere", there)
    without = servo(tmp_path / "b", "sphere", there, "motion.servo.null_space=none")
    assert with_it.outcome.ending is Ending.CONVERGED
    assert without.outcome.ending is Ending.TIME
    assert number(without, "radius_std_m") > 3.0 * number(with_it, "radius_std_m")


def test_approaching_along_the_line_of_sight_it_makes_the_radius_known_sooner(
    tmp_path: Path,
) -> None:
    far = ("sim.sphere.start.distance_m=0.45", "sim.features.noise_px=0.02", "run.duration_s=1.5")
    medians = []
    for null_space in ("information", "none"):
        times = [
            number(
                servo(
                    tmp_path / f"{null_space}{seed}",
                    "sphere",
                    f"motion.servo.null_space={null_space}",
                    *far,
                    seed=seed,
                ),
                "time_to_1pct_s",
            )
            for seed in range(3)
        ]
        medians.append(float(np.median(times)))
    assert medians[0] < 0.7 * medians[1]


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("distance_m", "0.02", "safety.min_target_distance_m"),
        ("distance_m", "1.5", "motion.max_target_distance_m"),
        ("position_px", "[700, 200]", "outside the image"),
        ("position_px", "[3, 200]", "outside the image"),
        ("position_px", "[20, 200]", "reaches out of the image"),
    ],
)
def test_a_place_that_cannot_be_is_refused_before_anything_moves(
    key: str, value: str, words: str, tmp_path: Path
) -> None:
    result = rig(
        *("run", "--target", "sphere", "--servo", "--out", str(tmp_path / "run")),
        *("--set", "sim.level=features", "--set", f"motion.servo.{key}={value}"),
    )
    assert result.exit_code == 2
    assert "motion.servo" in result.stderr and key in result.stderr and words in result.stderr


def test_the_command_says_where_the_target_ended(tmp_path: Path) -> None:
    result = rig(
        *("run", "--target", "sphere", "--servo", "--json", "--no-report", "--duration", "1"),
        *("--set", "sim.level=features", "--set", "motion.servo.distance_m=0.1"),
        *("--out", str(tmp_path / "run")),
    )
    assert result.exit_code == 0
    assert json.loads(result.stdout)["servo_distance_error_m"] > 0.05
    assert "not arrived" in result.stderr and "servo error" in result.stderr
