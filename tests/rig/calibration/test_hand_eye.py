"""Hand-eye: within its deviations, judged on poses it never saw, or an error with the remedy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.calibration import se3
from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye import HandEyeFit, HandEyeSettings, solve_hand_eye
from rig.calibration.hand_eye_start import closed_forms, translation_and_scale
from rig.calibration.hand_eye_std import pose_std
from rig.calibration.intrinsics import fit_intrinsics
from rig.calibration.lens_model import FULL
from rig.calibration.projection import to_vector
from rig.calibration.views import PosedView
from tests.rig.calibration.synthetic import (
    SIZE,
    SQUARE_M,
    Truth,
    board_points,
    posed_views,
    random_truth,
    transform,
    view,
)


def rotvec(T: np.ndarray) -> np.ndarray:
    return Rotation.from_matrix(T[:3, :3]).as_rotvec()


def errors(fit: HandEyeFit, truth: Truth) -> tuple[float, float]:
    """In mm and degrees."""
    off = se3.log(np.linalg.inv(truth.T_tool_camera) @ fit.T_tool_camera)
    return 1e3 * float(np.linalg.norm(off[:3])), float(np.degrees(np.linalg.norm(off[3:])))


def solved(views: list[PosedView], truth: Truth, **options: object) -> HandEyeFit:
    return solve_hand_eye(
        views, truth.intrinsics, FULL, SQUARE_M, HandEyeSettings.model_validate(options)
    )


def test_exact_data_give_the_exact_transform() -> None:
    truth = random_truth(1)
    views = posed_views(truth, 15, 1, noise_px=1e-4, arm_m=0.0, arm_rad=0.0)
    fit = solved(views, truth)
    mm, degrees = errors(fit, truth)
    assert mm < 0.005
    assert degrees < 2e-3
    assert np.allclose(fit.T_base_board, truth.T_base_board, atol=1e-4)
    assert fit.held_out.px < 0.02


def test_from_images_to_hand_eye_the_truth_lies_within_the_deviations() -> None:
    scatter = []
    for seed in range(3):
        truth = random_truth(seed)
        views = posed_views(truth, 30, seed, noise_px=0.05)
        lens = fit_intrinsics([one.board for one in views], SIZE)
        fit = solve_hand_eye(views, lens.intrinsics, lens.model, SQUARE_M)
        mm, degrees = errors(fit, truth)
        assert mm < 0.3
        assert degrees < 0.1
        assert fit.held_out.px < 0.15
        off = to_vector(fit.intrinsics) - to_vector(truth.intrinsics)
        assert np.max(np.abs(off[:2])) < 1e-3 * truth.intrinsics.fx_px
        fitted = fit.intrinsics_std > 0
        scatter += [
            (fit.T_tool_camera - truth.T_tool_camera)[:3, 3] / fit.std_xyz_m,
            (rotvec(fit.T_tool_camera) - rotvec(truth.T_tool_camera)) / fit.std_rotvec_rad,
            off[fitted] / fit.intrinsics_std[fitted],
        ]
    together = np.concatenate(scatter)
    assert np.mean(np.abs(together) < 3.0) >= 0.97
    assert 0.6 < np.sqrt(np.mean(together**2)) < 1.4


def test_an_inexact_arm_is_noticed_and_trusted_less() -> None:
    truth = random_truth(11)
    views = posed_views(truth, 30, 11, noise_px=0.05, arm_m=5e-4, arm_rad=1e-3)
    fit = solved(views, truth)
    assert fit.noise.arm_m == pytest.approx(5e-4, rel=0.6)
    assert fit.noise.arm_rad == pytest.approx(1e-3, rel=0.6)
    assert fit.noise.corner_px == pytest.approx(0.05, rel=0.15)
    off = (fit.T_tool_camera - truth.T_tool_camera)[:3, 3]
    assert np.all(np.abs(off) < 4.0 * fit.std_xyz_m)
    # The intrinsics come from the images then, not from an arm that contradicts them.
    assert abs(fit.intrinsics.fx_px - truth.intrinsics.fx_px) < 2.0


def test_bootstrap_and_curvature_agree_on_good_data() -> None:
    truth = random_truth(12)
    fit = solved(posed_views(truth, 40, 12), truth, bootstrap=1000)
    ratio = fit.bootstrap_xyz_m / fit.std_xyz_m
    assert np.all((ratio > 0.5) & (ratio <= 1.0 + 1e-9))


def test_held_out_views_do_not_touch_the_fit() -> None:
    truth = random_truth(13)
    views = posed_views(truth, 20, 13)
    first = solved(views, truth)
    for i in first.held_out_views:
        moved = views[i].T_base_tool @ transform([0.01, 0, 0], [0, 0, 0])
        views[i] = replace(views[i], T_base_tool=moved)
    second = solved(views, truth)
    assert np.array_equal(first.T_tool_camera, second.T_tool_camera)
    assert second.held_out.mm > 5.0 > first.held_out.mm
    assert not set(first.used) & set(first.held_out_views)


def test_an_image_paired_with_another_pose_is_left_out_and_named() -> None:
    truth = random_truth(14)
    views = posed_views(truth, 24, 14)
    views[6] = replace(views[6], T_base_tool=views[7].T_base_tool)
    fit = solved(views, truth)
    assert list(fit.rejected) == [6]
    assert "mm" in fit.rejected[6]
    assert errors(fit, truth)[0] < 0.4


def test_mostly_mispaired_images_are_refused() -> None:
    truth = random_truth(15)
    views = posed_views(truth, 20, 15)
    shifted = [
        replace(one, T_base_tool=other.T_base_tool)
        for one, other in zip(views, views[1:] + views[:1], strict=True)
    ]
    with pytest.raises(CalibrationError, match=r"contradict"):
        solved(shifted, truth)


def test_inverted_poses_are_refused() -> None:
    truth = random_truth(16)
    views = [
        replace(one, T_base_tool=np.linalg.inv(one.T_base_tool))
        for one in posed_views(truth, 16, 16)
    ]
    with pytest.raises(CalibrationError):
        solved(views, truth)


@pytest.mark.parametrize("ratio", [0.9, 1.02, 1.25])
def test_a_wrong_square_size_is_named_with_its_ratio(ratio: float) -> None:
    truth = random_truth(17)
    views = posed_views(truth, 24, 17, claimed_m=board_points(SQUARE_M / ratio))
    with pytest.raises(CalibrationError) as caught:
        solve_hand_eye(views, truth.intrinsics, FULL, SQUARE_M / ratio)
    assert f"ratio {ratio:.2f}" in str(caught.value)
    assert "30.0" in str(caught.value) or "29.9" in str(caught.value)


def test_two_poses_are_not_enough() -> None:
    truth = random_truth(18)
    with pytest.raises(CalibrationError, match=r"2 poses .* 8 are needed: add 6"):
        solved(posed_views(truth, 2, 18), truth)


def looking(
    truth: Truth, tilts: list[float], azimuth: float, spins: list[float]
) -> list[PosedView]:
    rng = np.random.default_rng(19)
    poses = [
        truth.tool_looking(0.38 + 0.004 * i, tilt, azimuth, spin)
        for i, (tilt, spin) in enumerate(zip(tilts, spins, strict=True))
    ]
    return [PosedView(view(truth, T, rng), T) for T in poses]


def test_turns_about_one_axis_ask_for_another() -> None:
    truth = random_truth(19)
    spins = np.linspace(-0.6, 0.6, 14).tolist()
    with pytest.raises(CalibrationError, match=r"same axis, the z axis .* Add poses turned"):
        solved(looking(truth, [0.0] * 14, 0.0, spins), truth)


def test_poses_without_turns_ask_for_turns() -> None:
    truth = random_truth(20)
    with pytest.raises(CalibrationError, match=r"hardly turns"):
        solved(looking(truth, [0.3] * 14, 0.5, [0.1] * 14), truth)


def test_the_closed_forms_agree_on_exact_data() -> None:
    truth = random_truth(21)
    views = posed_views(truth, 12, 21, noise_px=0.0, arm_m=0.0, arm_rad=0.0)
    arm = np.array([one.T_base_tool for one in views])
    board = np.array([truth.camera_from_tool(T) for T in arm])
    found = closed_forms(arm, board)
    assert len(found) == 5
    for T in found.values():
        assert np.allclose(T, truth.T_tool_camera, atol=1e-6)
    # Seen through a board claimed too small, everything is nearer, and only that.
    board[:, :3, 3] /= 1.2
    t, scale = translation_and_scale(truth.T_tool_camera[:3, :3], arm, board)
    assert scale == pytest.approx(1.2, abs=1e-9)
    assert np.allclose(t, truth.T_tool_camera[:3, 3], atol=1e-9)


def test_deviations_of_a_rotation_vector_hold_for_large_turns() -> None:
    T = transform([0.1, 0.2, 0.3], 2.5 * np.array([0.6, -0.8, 0.0]))
    rng = np.random.default_rng(22)
    spread = np.array([1e-4, 2e-4, 3e-4, 1e-3, 2e-3, 3e-3])
    drawn = T @ se3.exp(spread * rng.standard_normal((20_000, 6)))
    std_xyz_m, std_rotvec_rad = pose_std(T, np.diag(spread**2))
    assert np.allclose(std_xyz_m, np.std(drawn[:, :3, 3], axis=0), rtol=0.03)
    measured = np.std(Rotation.from_matrix(drawn[:, :3, :3]).as_rotvec(), axis=0)
    assert np.allclose(std_rotvec_rad, measured, rtol=0.03)
