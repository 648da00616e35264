"""``rig calibrate intrinsics --from-images``: pictures in, the intrinsics part out."""

import json
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.calibration.board import BoardConfig
from rig.calibration.result import load_calibration
from tests.rig.calibration.synthetic import FloatArray, random_truth, tool_poses
from tests.rig.calibration.synthetic_image import picture, print_of
from tests.rig.command_line import Outcome, rig

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
