"""``rig calibrate intrinsics --from-images``: pictures in, the intrinsics part out."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.calibration.board import BoardConfig
from rig.calibration.result import CalibrationFile, load_calibration, save_calibration
from rig.commands.calibrate_request import Step, earlier
from rig.config import RigConfig
from rig.config_load import load_config
from rig.fingerprints import fingerprints
from tests.rig.calibration.synthetic import FloatArray, random_truth, tool_poses
from tests.rig.calibration.synthetic_image import picture, print_of
from tests.rig.command_line import Outcome, rig
from tests.rig.made_calibration import calibration_of

TRUTH = random_truth(3, distortion=False)
PAPER = print_of(BoardConfig())


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pictures").mkdir()
    return tmp_path


def save(poses: Sequence[FloatArray], suffixes: Sequence[str] = (".png",)) -> None:
    rng = np.random.default_rng(5)
    for number, T in enumerate(poses):
        name = f"{number:02d}{suffixes[number % len(suffixes)]}"
        cv2.imwrite(f"pictures/{name}", picture(TRUTH, T, PAPER, rng))


def from_images(*arguments: str) -> Outcome:
    return rig("calibrate", "intrinsics", "--from-images", "pictures", *arguments)


def test_pictures_of_several_formats_give_the_intrinsics(here: Path) -> None:
    save(tool_poses(TRUTH, 14, seed=2), (".png", ".jpg", ".JPEG"))
    cv2.imwrite("pictures/nothing.png", np.full((480, 640), 90, np.uint8))
    done = from_images("--json")
    assert done.exit_code == 0, done.stderr
    found, true = json.loads(done.stdout), TRUTH.intrinsics
    for name in ("fx", "fy", "cx", "cy"):
        value, std = found["intrinsics"][name], found["intrinsics"]["std"][name]
        assert abs(value - getattr(true, f"{name}_px")) < 4.0 * std
    assert found["intrinsics"]["fx"] == pytest.approx(true.fx_px, rel=2e-3)
    assert "nothing.png: left out, no board in view" in done.stderr
    lens = load_calibration(here / "calibration" / "sim.yaml").intrinsics
    assert lens is not None and lens.from_images
    assert lens.obtained.startswith("images: 14 of 15 in pictures")
    assert "hand-eye is missing" in " ".join(found["reasons"])


@pytest.mark.slow
def test_only_the_board_s_definition_is_needed_of_a_rig(here: Path) -> None:
    (here / "lab.yaml").write_text(
        "name: lab\ncamera: {driver: opencv, source: /dev/video7}\n"
        "arm: {driver: ur, host: 192.168.0.100}\n"
        "calibration: {board: {squares: [7, 5], square_m: 0.03, marker_m: 0.022}}\n",
        encoding="utf-8",
    )
    save(tool_poses(TRUTH, 10, seed=2))
    done = from_images("--rig", "lab.yaml")
    assert done.exit_code == 0, done.stderr
    assert (here / "calibration" / "lab.yaml").exists()


def test_too_few_pictures_are_counted(here: Path) -> None:
    save(tool_poses(TRUTH, 4, seed=2))
    done = from_images()
    assert done.exit_code == 6
    assert "4 usable views of the board, at least 8 are needed" in done.stderr
    assert not (here / "calibration").exists()


@pytest.mark.slow
def test_pictures_from_the_front_only_are_not_enough() -> None:
    save([TRUTH.tool_looking(0.3 + 0.02 * k, 0.03, 1.0 * k, 0.1 * k) for k in range(9)])
    done = from_images()
    assert done.exit_code == 6
    assert "tilted" in done.stderr


def test_pictures_of_another_size_are_named() -> None:
    save(tool_poses(TRUTH, 2, seed=2))
    cv2.imwrite("pictures/small.png", np.zeros((240, 320), np.uint8))
    done = from_images()
    assert done.exit_code == 2
    assert "different sizes" in done.stderr and "small.png" in done.stderr


def test_pictures_in_another_mode_than_the_camera_s_are_refused(here: Path) -> None:
    (here / "lab.yaml").write_text(
        "camera: {driver: opencv, source: /dev/video7, width: 1280, height: 720}\n",
        encoding="utf-8",
    )
    save(tool_poses(TRUTH, 1, seed=2))
    done = from_images("--rig", "lab.yaml")
    assert done.exit_code == 2
    assert "640x480" in done.stderr and "1280x720" in done.stderr


def test_pictures_without_the_board_say_why() -> None:
    for number in range(9):
        cv2.imwrite(f"pictures/{number}.png", np.full((480, 640), 90, np.uint8))
    done = from_images()
    assert done.exit_code == 6
    assert "seen in 0 of 9 pictures" in done.stderr and "uniform" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("intrinsics", "--from-images", "nowhere"), "no such folder"),
        (("intrinsics", "--from-images", "pictures"), "no pictures there"),
        (("hand-eye", "--from-images", "pictures"), "takes the arm"),
        (("latency", "--from-images", "pictures"), "does not go with"),
        (("--from-images", "pictures", "--dry-run"), "do not go together"),
    ],
)
def test_what_cannot_be_is_refused(arguments: tuple[str, ...], words: str) -> None:
    done = rig("calibrate", *arguments)
    assert done.exit_code == 2
    assert words in done.stderr


def test_a_file_that_is_no_picture_is_named(here: Path) -> None:
    (here / "pictures" / "broken.jpg").write_bytes(b"not a picture")
    done = from_images()
    assert done.exit_code == 2
    assert "broken.jpg cannot be read" in done.stderr


SMALL = (
    *("calibration.plan.poses=12", "calibration.plan.verify_poses=2", "sim.renderer=raster"),
    *("calibration.plan.segment_s=3", "calibration.plan.hand_eye.bootstrap=50"),
    *("sim.camera.width=320", "sim.camera.height=240", "sim.camera.focal_px=400"),
)


def on_the_rig(step: str, *settings: str) -> Outcome:
    return rig("calibrate", step, "--json", *(f"--set={one}" for one in (*SMALL, *settings)))


def pictures_by(focal_px: float) -> None:
    """Pictures of the simulated board by a camera of this focal length, in ``pictures``."""
    started = f"{{fx_px: {focal_px}, fy_px: {focal_px}, cx_px: 159.5, cy_px: 119.5}}"
    done = on_the_rig(
        "hand-eye", f"sim.camera.focal_px={focal_px}", f"calibration.intrinsics={started}"
    )
    assert done.exit_code == 0, done.stderr
    for path in Path("calibration/sim-data").glob("still-*.png"):
        path.rename(Path("pictures") / path.name)
    shutil.rmtree("calibration")


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_step_by_step_from_pictures_to_a_calibration_that_a_run_takes(here: Path) -> None:
    pictures_by(400.0)
    assert from_images(*(f"--set={one}" for one in SMALL)).exit_code == 0
    for step in ("hand-eye", "latency", "verify"):
        done = on_the_rig(step)
        assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["verdict"] == "passed"
    assert found["hand_eye"]["T_tool_camera"][:3] == pytest.approx([0.03, -0.02, 0.06], abs=3e-4)
    file = load_calibration(here / "calibration" / "sim.yaml")
    assert file.pictures is not None and file.intrinsics is not None
    # Known better than from either alone.
    assert file.intrinsics.std.fx_px < file.pictures.std.fx_px
    scene = ("sim.renderer=raster", *SMALL[5:])
    run = rig("run", "--target", "sphere", "--json", *(f"--set={one}" for one in scene))
    assert run.exit_code == 0, run.stderr
    assert abs(json.loads(run.stdout)["relative_error"]) < 3e-3


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_pictures_of_another_camera_are_told_by_the_rig_s_own(here: Path) -> None:
    pictures_by(380.0)
    assert from_images(*(f"--set={one}" for one in SMALL)).exit_code == 0
    done = on_the_rig("hand-eye")
    assert done.exit_code == 6
    assert "the pictures say fx = 380" in done.stderr
    assert "rig calibrate intrinsics" in done.stderr


def file_from_pictures(config: RigConfig) -> CalibrationFile:
    """A calibration that began with pictures."""
    file = calibration_of(config)
    return file.model_copy(update={"pictures": file.intrinsics})


@pytest.mark.parametrize("step", ["hand-eye", "all"])
def test_pictures_of_another_mode_are_no_longer_used(
    here: Path, step: Step, capsys: pytest.CaptureFixture[str]
) -> None:
    config, path = load_config("sphere"), here / "sim.yaml"
    save_calibration(file_from_pictures(config), path)
    now = fingerprints(config)
    kept = earlier(step, path, now)
    assert kept is not None and kept.pictures is not None
    left = earlier(step, path, {**now, "camera": "another"})
    assert left is None or left.pictures is None
    assert (
        "the intrinsics from pictures are not used: the camera changed" in capsys.readouterr().err
    )


def test_looking_for_intrinsics_with_the_arm_leaves_pictures_aside(here: Path) -> None:
    config, path = load_config("sphere"), here / "sim.yaml"
    save_calibration(file_from_pictures(config), path)
    left = earlier("intrinsics", path, fingerprints(config))
    assert left is not None and left.pictures is None
