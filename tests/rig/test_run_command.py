"""``rig run`` as a user meets it: what it prints, what it leaves behind, how it exits."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.summary import JSON_KEYS
from tests.rig.command_line import rig
from tests.rig.log_lines import log_bytes, log_lines

RASTER = ("--set", "sim.renderer=raster")


def run_json(*arguments: str, out: Path, status: int = 0) -> dict:
    result = rig("run", "--json", "--out", str(out), *RASTER, *arguments)
    assert result.exit_code == status, result.stderr
    return json.loads(result.stdout)  # exactly one object, nothing else


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_the_main_job_finds_the_radius_from_pixels(
    target: str,
    tmp_path: Path,
) -> None:
    result = run_json("--target", target, out=tmp_path)
    assert tuple(result) == JSON_KEYS
    assert abs(result["relative_error"]) < 2e-3
    assert result["radius_m"] == pytest.approx(result["radius_true_m"], rel=2e-3)
    assert result["estimator"] == "kalman"
    assert result["rms_vs_ideal"] < 5e-3  # of the paper's observer on the same images
    assert result["time_to_1pct_s"] <= 0.3
    assert abs(result["radius_m"] - result["radius_true_m"]) < 4.0 * result["radius_std_m"]
    assert result["frames"] > 150
    assert result["frames_lost"] == 0
    assert result["overruns"] == 0
    assert result["renderer"] == "raster"
    assert json.loads((tmp_path / "summary.json").read_text())["radius_m"] == result["radius_m"]
    report = cv2.imread(str(tmp_path / "report.png"))
    assert report.shape[0] > 500 and len(np.unique(report)) > 50
    assert (tmp_path / "config.yaml").is_file()


def test_a_gain_of_the_observer_chooses_the_observer(tmp_path: Path) -> None:
    arguments = ("--target", "sphere", "--set", "estimator.alpha=2000")
    result = run_json(*arguments, out=tmp_path)
    assert tuple(result) == JSON_KEYS
    assert result["estimator"] == "observer"
    assert result["rms_vs_ideal"] < 5e-3
    assert 1.0 < result["time_to_1pct_s"] < 5.0
    assert result["radius_std_m"] is result["nees"] is None


def test_the_same_seed_gives_the_same_run_and_another_seed_another(tmp_path: Path) -> None:
    results, logs = [], []
    for name, seed in (("a", "3"), ("b", "3"), ("c", "4")):
        results.append(
            run_json(
                *("--target", "sphere", "--seed", seed, "--duration", "1.5"),
                out=tmp_path / name,
            )
        )
        logs.append(log_bytes(tmp_path / name))
        assert results[-1]["seed"] == int(seed)
        del results[-1]["wall_s"], results[-1]["run_dir"]
    assert results[0] == results[1]
    assert logs[0] == logs[1]
    assert results[0]["radius_m"] != results[2]["radius_m"]


def test_a_stored_configuration_repeats_the_run(tmp_path: Path) -> None:
    arguments = ("--target", "sphere", "--duration", "1", "--set", "estimator.alpha=6000")
    first = run_json(*arguments, out=tmp_path / "a")
    again = run_json(
        *("--target", "sphere", "--rig", str(tmp_path / "a" / "config.yaml")),
        out=tmp_path / "b",
    )
    assert again["radius_m"] == first["radius_m"]


@pytest.mark.parametrize(
    ("target", "radius"), [("sphere", "0.013"), ("sphere", "0.03"), ("cylinder", "0.03")]
)
def test_another_radius_is_found_as_well(
    target: str,
    radius: str,
    tmp_path: Path,
) -> None:
    result = run_json(
        *("--target", target, "--set", f"sim.{target}.radius_m={radius}"),
        out=tmp_path,
    )
    assert result["radius_true_m"] == float(radius)
    assert abs(result["relative_error"]) < 5e-3


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_late_and_missing_images_cost_less_than_two_thousandths(
    target: str,
    tmp_path: Path,
) -> None:
    easy, hard = (
        run_json(
            *("--target", target, "--duration", "7", *settings),
            out=tmp_path / name,
        )
        for name, settings in (
            ("easy", ()),
            (
                "hard",
                (
                    *("--set", "sim.camera.latency_s=0.08"),
                    *("--set", "sim.camera.latency_jitter_s=0.01"),
                    *("--set", "sim.camera.drop_probability=0.1"),
                ),
            ),
        )
    )
    assert hard["frames"] < 0.95 * easy["frames"]
    assert abs(hard["radius_m"] / easy["radius_m"] - 1.0) < 2e-3
    assert abs(hard["relative_error"]) < 2e-3


def test_a_target_out_of_view_ends_with_its_own_status_and_no_radius(tmp_path: Path) -> None:
    result = run_json(
        *("--target", "sphere", "--set", "sim.sphere.start.offset_px=[900, 0]"),
        out=tmp_path,
        status=4,
    )
    assert result["radius_m"] is None
    assert result["relative_error"] is None


def test_leaving_the_workspace_is_a_safety_stop(tmp_path: Path) -> None:
    result = run_json(
        *("--target", "sphere", "--set", "safety.workspace_min_m=[-2, -2, 1.5]"),
        out=tmp_path,
        status=5,
    )
    assert result["radius_m"] is None
    assert "outside the workspace" in json.loads((tmp_path / "summary.json").read_text())["error"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--target", "sphere", "--set", "estimator.gain=1"), "alpha"),
        (("--target", "sphere", "--set", "sim.sphere.radius_m=-1"), "sim.sphere.radius_m"),
        (("--target", "sphere", "--duration", "-1"), "run.duration_s"),
        (("--target", "sphere", "--rig", "nowhere.yaml"), "nowhere.yaml"),
        (("--target", "cube"), "cube"),
        ((), "--target"),
    ],
)
def test_wrong_usage_exits_2_says_why_and_leaves_nothing_behind(
    arguments: tuple[str, ...],
    words: str,
    tmp_path: Path,
) -> None:
    out = tmp_path / "run"
    result = rig("run", "--json", "--out", str(out), *arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert words in result.stderr
    assert not out.exists()


@pytest.mark.realtime
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_in_real_time_ramps_the_arm_to_rest(number: int, tmp_path: Path) -> None:
    process = subprocess.Popen(
        [
            *(sys.executable, "-c", "from rig.cli import main; main()", "run"),
            *("--target", "sphere", "--realtime", "--duration", "60", "--json"),
            *("--out", str(tmp_path), *RASTER),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    try:
        assert process.stderr is not None
        for line in process.stderr:
            speed = re.search(r"speed ([\d.]+) mm/s", line)
            if speed and float(speed.group(1)) > 40.0:
                break
        process.send_signal(number)
        output, _ = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert json.loads(output)["target"] == "sphere"
    lines = log_lines(tmp_path)
    assert lines[-1]["kind"] == "event" and lines[-1]["detail"] == "interrupted"
    speeds = [np.linalg.norm(line["twist_tool"][:3]) for line in lines if line["kind"] == "arm"]
    assert max(speeds) > 0.03
    assert speeds[-1] < 2e-3
    allowed = [line["allowed"] for line in lines if line["kind"] == "command"]
    assert not np.any(allowed[-1])


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_the_kalman_filter_states_an_interval_and_ends_when_it_is_narrow(
    target: str, tmp_path: Path
) -> None:
    settings = ("--set", "estimator.kind=kalman", "--set", "sim.level=features")
    result = run_json("--target", target, *settings, "--until", "0.5%", out=tmp_path)
    assert tuple(result) == JSON_KEYS
    assert result["rms_vs_ideal"] < 5e-3
    assert result["sim_s"] < 1.0
    assert 0.0 < 1.96 * result["radius_std_m"] <= 0.005 * result["radius_m"]
    assert abs(result["radius_m"] - result["radius_true_m"]) < 4.0 * result["radius_std_m"]
    assert result["nees"] < 16.0


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (("calibration.latency_s=0.05",), "the latency is wrong"),
        (
            ("estimator.radius_range_m=[0.03, 0.1]", "estimator.radius_guess_m=0.05"),
            "outside the range it was said to lie in, 30 to 100 mm",
        ),
        (("motion.velocity_m_s=[0, 0, 0.0005]",), "this motion did not tell the radius"),
        (
            (
                *("estimator.states=[speed_scale]", "motion.velocity_m_s=[0, 0, 0.03]"),
                "sim.sphere.start.offset_px=[0, 0]",  # so that the camera need not turn
            ),
            "speed_scale is not observable",
        ),
    ],
)
def test_what_makes_the_estimate_doubtful_is_said_in_one_line(
    settings: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    given = [part for one in ("sim.level=features", *settings) for part in ("--set", one)]
    arguments = ("run", "--target", "sphere", "--duration", "1", "--no-report", *given)
    result = rig(*arguments, "--json", "--out", str(tmp_path))
    assert result.exit_code == 0
    assert len([line for line in result.stderr.splitlines() if words in line]) == 1


def test_an_unknown_time_offset_is_found(tmp_path: Path) -> None:
    settings = ("sim.level=features", "sim.camera.stamps=arrival", "estimator.states=[time_offset]")
    given = [part for one in settings for part in ("--set", one)]
    result = run_json("--target", "sphere", "--duration", "2", *given, out=tmp_path)
    # Each image is late by 40 ms give or take 3, which this run tells over 60 images.
    assert abs(result["time_offset_s"] - 0.04) < 2e-3
    assert 0.0 < result["time_offset_std_s"] < 1e-3
    assert result["speed_scale"] is result["speed_scale_std"] is None
    assert abs(result["relative_error"]) < 2e-3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--until", "0.5%", "--set", "estimator.kind=observer"), "estimator.kind=kalman"),
        (("--until", "half"), "0.5%"),
        (("--set", "estimator.radius_range_m=[0.05, 0.1]"), "radius_guess_m"),
    ],
)
def test_an_interval_that_nobody_states_cannot_end_a_run(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    result = rig("run", "--target", "sphere", "--out", str(tmp_path / "run"), *arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert not (tmp_path / "run").exists()


def test_moving_for_information_beats_moving_along_the_line_of_sight(tmp_path: Path) -> None:
    settings = (
        *("--set", "estimator.kind=kalman", "--set", "sim.level=features"),
        *("--set", "sim.features.noise_px=0.1", "--set", "motion.velocity_m_s=[0, 0, 0.05]"),
        *("--duration", "1.5"),
    )
    took_s = {}
    for policy in ("constant", "information"):
        out = tmp_path / policy
        arguments = ("--target", "sphere", *settings, "--set", f"motion.policy={policy}")
        took_s[policy] = run_json(*arguments, out=out)["time_to_1pct_s"]
    assert took_s["information"] <= 0.3
    assert took_s["constant"] is None or took_s["constant"] >= 2.0 * took_s["information"]
