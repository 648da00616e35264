"""The calibration file: it comes back as it was, and says which step to repeat."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from drivers.errors import ConfigError
from rig.calibration.board import BoardConfig
from rig.calibration.hand_eye import HandEyeFit, solve_hand_eye
from rig.calibration.intrinsics import IntrinsicsFit, fit_intrinsics
from rig.calibration.latency import LatencyFit
from rig.calibration.latency_refine import Segment
from rig.calibration.result import (
    CalibrationFile,
    Verdict,
    fingerprint,
    load_calibration,
    save_calibration,
)
from rig.calibration.result_check import Requirements, check_usable, judge, stale
from rig.calibration.result_make import (
    hand_eye_result,
    intrinsics_of,
    intrinsics_result,
    latency_result,
    tool_camera_of,
    verification_result,
)
from rig.calibration.wiggle import WiggleVerdict
from tests.rig.calibration.synthetic import SIZE, SQUARE_M, posed_views, random_truth

NOW = {name: fingerprint(name) for name in ("camera", "tcp", "board", "arm")}
SEGMENT = Segment(0.04, 2e-5, 0.0, 0.0, 0.1, 70)
LATENCY = LatencyFit(0.04, 2e-5, (SEGMENT, SEGMENT), 0.99, 90.0, 0.0, 0.0)


@dataclass(frozen=True)
class Fits:
    intrinsics: IntrinsicsFit
    hand_eye: HandEyeFit
    file: CalibrationFile


@pytest.fixture(scope="module")
def fits() -> Fits:
    truth = random_truth(1)
    views = posed_views(truth, 20, 1)
    lens = fit_intrinsics([one.board for one in views], SIZE)
    hand_eye = solve_hand_eye(views, lens.intrinsics, lens.model, SQUARE_M)
    file = CalibrationFile(
        rig="bench",
        made="2026-11-23 10:00",
        board=BoardConfig(),
        intrinsics=intrinsics_result(
            lens, SIZE, {"camera": NOW["camera"], "board": NOW["board"]}, hand_eye
        ),
        hand_eye=hand_eye_result(hand_eye, NOW),
        latency=latency_result(LATENCY, {"camera": NOW["camera"], "arm": NOW["arm"]}),
        verification=verification_result(WiggleVerdict(True, (), ()), NOW, 0.1),
    )
    return Fits(lens, hand_eye, file)


def test_the_file_comes_back_as_it_was(fits: Fits, tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "bench.yaml"
    file = fits.file.model_copy(update={"verdict": judge(fits.file)})
    save_calibration(file, path)
    assert load_calibration(path) == file
    assert [one.name for one in path.parent.iterdir()] == ["bench.yaml"]


def test_the_file_holds_the_fitted_values(fits: Fits) -> None:
    assert fits.file.intrinsics is not None
    assert fits.file.hand_eye is not None
    found = intrinsics_of(fits.file.intrinsics)
    assert found.fx_px == fits.hand_eye.intrinsics.fx_px
    assert np.array_equal(found.distortion, fits.hand_eye.intrinsics.distortion)
    assert np.allclose(tool_camera_of(fits.file.hand_eye), fits.hand_eye.T_tool_camera)


def test_a_good_complete_calibration_passes(fits: Fits) -> None:
    assert judge(fits.file) == Verdict(passed=True)
    check_usable(fits.file, NOW, Path("bench.yaml"))


@pytest.mark.parametrize(
    ("step", "command"),
    [
        ("intrinsics", "intrinsics"),
        ("hand_eye", "hand-eye"),
        ("latency", "latency"),
        ("verification", "verify"),
    ],
)
def test_a_missing_step_is_named_with_its_command(fits: Fits, step: str, command: str) -> None:
    file = fits.file.model_copy(update={step: None})
    verdict = judge(file)
    assert not verdict.passed
    assert len(verdict.reasons) == 1
    assert f"rig calibrate {command}" in verdict.reasons[0]


def test_what_is_not_good_enough_is_named(fits: Fits) -> None:
    strict = Requirements(max_held_out_px=1e-3, max_latency_std_s=1e-6)
    reasons = judge(fits.file, strict).reasons
    assert len(reasons) == 3
    assert "held-out images" in reasons[0]
    assert "held-out poses" in reasons[1]
    assert "latency" in reasons[2]


def test_a_failed_verification_fails_the_calibration(fits: Fits) -> None:
    failed = verification_result(WiggleVerdict(False, ("wrong sign",), ()), NOW)
    reasons = judge(fits.file.model_copy(update={"verification": failed})).reasons
    assert "wrong sign" in reasons[0]


@pytest.mark.parametrize(
    ("part", "steps"),
    [
        ("tcp", ["hand-eye", "verify"]),
        ("camera", ["intrinsics", "hand-eye", "latency", "verify"]),
        ("board", ["intrinsics", "hand-eye", "verify"]),
        ("arm", ["hand-eye", "latency", "verify"]),
    ],
)
def test_a_changed_rig_names_the_steps_to_repeat(fits: Fits, part: str, steps: list[str]) -> None:
    now = NOW | {part: fingerprint("other")}
    reasons = stale(fits.file, now)
    assert [one.split("`rig calibrate ")[1].split("`")[0] for one in reasons] == steps
    with pytest.raises(ConfigError, match="--uncalibrated"):
        check_usable(fits.file, now, Path("bench.yaml"))


def test_what_cannot_be_told_is_not_held_against_the_file(fits: Fits) -> None:
    assert stale(fits.file, {"camera": NOW["camera"]}) == []


def test_a_failed_verdict_is_not_usable(fits: Fits) -> None:
    file = fits.file.model_copy(update={"verdict": Verdict(passed=False, reasons=("blurred",))})
    with pytest.raises(ConfigError, match="blurred"):
        check_usable(file, NOW, Path("bench.yaml"))


def test_fingerprints_tell_values_apart_and_ignore_order() -> None:
    assert fingerprint({"a": 1, "b": [1, 2]}) == fingerprint({"b": [1, 2], "a": 1})
    assert fingerprint({"a": 1}) != fingerprint({"a": 2})


def test_a_missing_file_says_how_to_get_one(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="make it with `rig calibrate`"):
        load_calibration(tmp_path / "none.yaml")


@pytest.mark.parametrize("text", ["", "[1, 2]", "{a: [", "rig: x", "version: 2"])
def test_a_broken_file_is_refused_with_its_name(tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"broken\.yaml"):
        load_calibration(path)


def test_an_unwritable_place_is_refused(fits: Fits, tmp_path: Path) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("", encoding="utf-8")
    with pytest.raises(ConfigError, match="cannot write"):
        save_calibration(fits.file, blocker / "bench.yaml")


def test_an_interrupted_write_leaves_the_old_file(
    fits: Fits, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "bench.yaml"
    save_calibration(fits.file, path)
    before = path.read_text(encoding="utf-8")

    def fails(self: Path, target: Path) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(Path, "replace", fails)
    with pytest.raises(ConfigError, match="disk full"):
        save_calibration(fits.file.model_copy(update={"rig": "other"}), path)
    assert path.read_text(encoding="utf-8") == before
