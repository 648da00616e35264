"""Intrinsics hold for images of one size: others are refused before anything moves."""

import json
from pathlib import Path

import numpy as np
import pytest

from rig.calibration.result import save_calibration
from rig.calibration_place import calibration_path
from rig.config_load import load_config
from rig.log.lines import lines
from rig.log.reader import open_log
from tests.rig.command_line import rig
from tests.rig.made_calibration import calibration_of


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def save(*, size_px: tuple[int, int], from_images: bool = False) -> None:
    config = load_config("sphere")
    file = calibration_of(config)
    assert file.intrinsics is not None
    width, height = size_px
    lens = {"width": width, "height": height, "from_images": from_images}
    intrinsics = file.intrinsics.model_copy(update=lens)
    changed = {"intrinsics": intrinsics, "pictures": intrinsics if from_images else None}
    save_calibration(file.model_copy(update=changed), calibration_path(config))


def test_a_run_refuses_images_of_another_size_than_its_calibration_s(here: Path) -> None:
    save(size_px=(1280, 960))
    done = rig("run", "--target", "sphere", "--out", "run", "--set=sim.renderer=raster")
    assert done.exit_code == 6
    assert "640x480" in done.stderr and "1280x960" in done.stderr
    assert "rig calibrate" in done.stderr
    sent = [one["allowed"] for one in lines(open_log(here / "run")) if one["kind"] == "command"]
    assert not np.any(sent)


def test_calibrating_refuses_images_of_another_size_than_the_pictures(here: Path) -> None:
    save(size_px=(1280, 960), from_images=True)
    done = rig("calibrate", "hand-eye", "--set=sim.renderer=raster")
    assert done.exit_code == 6
    assert "1280x960" in done.stderr
    assert not list((here / "calibration" / "sim-data").glob("still-*"))


def test_images_of_the_right_size_are_taken(here: Path) -> None:
    save(size_px=(640, 480))
    rig("run", "--target=sphere", "--duration=0.3", "--out=run", "--set=sim.renderer=raster")
    assert json.loads((here / "run" / "summary.json").read_text())["radius_m"] is not None
