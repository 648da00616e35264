"""``rig calibrate`` when something is wrong: each has words that say what, and what to do."""

import os
from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from drivers.interfaces import Frame
from sim_backend.camera import SimulatedCamera
from tests.rig.calibration_run.small_rig import calibrate


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["sim.board.visible=false"], "no board in view"),
        (["sim.board.dictionary=DICT_5X5_100"], "its markers are of DICT_5X5_*"),
        (["calibration.board.squares=[4,3]"], "wrong board: marker"),
        (["sim.board.start.offset_px=[170,120]"], "corners of the board in view, 6 needed"),
    ],
)
def test_a_board_that_cannot_be_used_is_named(settings: list[str], words: str) -> None:
    done = calibrate("--json", settings=tuple(settings))
    assert done.exit_code == 6
    assert words in done.stderr
    assert "start again" in done.stderr
    assert done.stdout == ""


@pytest.mark.slow
def test_a_board_printed_too_large_is_told_by_the_arm_s_motion() -> None:
    done = calibrate(settings=("sim.board.square_m=0.0315", "sim.board.marker_m=0.0231"))
    assert done.exit_code == 6
    assert "by the ratio 1.050" in done.stderr
    assert "31.5" in done.stderr and "30.00 mm" in done.stderr


@pytest.mark.slow
def test_a_board_half_as_large_is_told_although_most_poses_do_not_show_it() -> None:
    done = calibrate(settings=("sim.board.square_m=0.015", "sim.board.marker_m=0.011"))
    assert done.exit_code == 6
    assert "by the ratio 0.50, roughly" in done.stderr


def test_blurred_pictures_are_called_blurred(monkeypatch: pytest.MonkeyPatch) -> None:
    sharp = SimulatedCamera.read

    def read(camera: SimulatedCamera, timeout_s: float) -> Frame | None:
        frame = sharp(camera, timeout_s)
        if frame is None:
            return None
        return replace(frame, image=cv2.GaussianBlur(frame.image, (0, 0), 2.5))

    monkeypatch.setattr(SimulatedCamera, "read", read)
    sharp_enough_for_markers = ("width=640", "height=480", "focal_px=800")
    done = calibrate(settings=tuple(f"sim.camera.{one}" for one in sharp_enough_for_markers))
    assert done.exit_code == 6
    assert "the image is blurred" in done.stderr and "focus" in done.stderr


def test_no_room_for_enough_poses_is_said_with_what_to_widen() -> None:
    box = (
        "safety.workspace_min_m=[-0.3,-0.3,0.68]",
        "safety.workspace_max_m=[0.3,0.3,0.75]",
    )
    done = calibrate(settings=(*box, "calibration.plan.limits.max_turn_rad=0.05"))
    assert done.exit_code == 6
    assert "8 are needed" in done.stderr
    assert "widen" in done.stderr


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_said_before_anything_moves(here: Path) -> None:
    (here / "calibration").mkdir(mode=0o500)
    done = calibrate()
    assert done.exit_code == 2
    assert "cannot write" in done.stderr


def test_a_file_in_the_folder_s_place_is_said_before_anything_moves(here: Path) -> None:
    (here / "calibration").write_text("in the way", encoding="utf-8")
    done = calibrate()
    assert done.exit_code == 2
    assert "cannot write" in done.stderr
