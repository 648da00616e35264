"""The report of a calibration: one file that needs nothing else, with what there is to show."""

import re
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest

from rig.calibration.board import BoardConfig
from rig.calibration.hand_eye import solve_hand_eye
from rig.calibration.intrinsics import fit_intrinsics
from rig.calibration.result import CalibrationFile, Verdict
from rig.calibration.result_make import hand_eye_result, intrinsics_result
from rig.calibration_report.material import Material, pose_errors
from rig.calibration_report.page import write_report
from rig.calibration_run.fits import Geometry
from rig.calibration_run.stills import Still
from tests.rig.calibration.synthetic import SIZE, SQUARE_M, posed_views, random_truth


@pytest.fixture(scope="module")
def material() -> Material:
    """Intrinsics and hand-eye only, as after the first step."""
    views = posed_views(random_truth(2), 20, 2)
    lens = fit_intrinsics([one.board for one in views], SIZE)
    hand_eye = solve_hand_eye(views, lens.intrinsics, lens.model, SQUARE_M)
    file = CalibrationFile(
        rig="bench & co",
        made="20261123-100000",
        board=BoardConfig(),
        intrinsics=intrinsics_result(lens, SIZE, {"camera": "1"}, hand_eye),
        hand_eye=hand_eye_result(hand_eye, {"camera": "1"}),
        verdict=Verdict(passed=False, reasons=("latency is missing: run `rig calibrate latency`",)),
    )
    image = np.zeros(SIZE[::-1], np.uint8)
    stills = [Still(view, image, 0.0, 0.0) for view in views]
    return Material(file, stills, Geometry(lens, hand_eye), None, None, None)


@pytest.fixture(scope="module")
def page(material: Material, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calibration") / "report"
    folder.mkdir()
    (folder / "latency.png").write_bytes(b"of a calibration before")
    return write_report(folder, material)


def test_the_page_is_whole_by_itself(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert text.count("data:image/png;base64,") == 3
    assert not re.search(r"(src|href)=\"(?!data:)", text)
    assert "http" not in text


def test_beside_it_are_its_pictures_and_none_from_before(page: Path) -> None:
    pictures = sorted(one.name for one in page.parent.glob("*.png"))
    assert pictures == ["coverage.png", "poses.png", "residuals.png"]


def test_the_verdict_and_its_reasons_come_first(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert text.index("not usable") < text.index("latency is missing") < text.index("Values")
    assert "bench &amp; co" in text
    assert "Not part of this step." in text  # latency and small motions


def test_values_stand_with_their_deviations(material: Material, page: Path) -> None:
    text = unescape(page.read_text(encoding="utf-8"))
    lens = material.file.intrinsics
    assert lens is not None
    assert f"{lens.fx_px:.3f} ± {lens.std.fx_px:.3f}" in text
    assert lens.obtained in text


def test_without_anything_collected_the_values_are_left(material: Material, tmp_path: Path) -> None:
    page = write_report(tmp_path, replace(material, stills=[], geometry=None))
    assert "data:image" not in page.read_text(encoding="utf-8")


def test_the_poses_errors_are_those_of_the_fit(material: Material) -> None:
    assert material.geometry is not None
    errors = pose_errors(material.stills, material.geometry)
    fit = material.geometry.hand_eye
    assert np.allclose(errors.px, fit.per_view_px, rtol=1e-6)
    held = errors.px[fit.held_out_views]
    assert np.sqrt(np.mean(held**2)) == pytest.approx(fit.held_out.px, rel=0.1)
