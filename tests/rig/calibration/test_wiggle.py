"""The wiggle test passes a right calibration and says what is wrong with a wrong one."""

from collections.abc import Callable

import numpy as np
import pytest

from rig.calibration import se3
from rig.calibration.errors import CalibrationError
from rig.calibration.views import BoardView, PosedView
from rig.calibration.wiggle import Wiggle, WiggleVerdict, judge_wiggles, wiggle_steps
from tests.rig.calibration.synthetic import random_truth, transform, view

Change = Callable[[np.ndarray], np.ndarray]


def same(T: np.ndarray) -> np.ndarray:
    return T


def verdict(
    seed: int = 3, camera: Change = same, reported: Change = same, tcp: np.ndarray | None = None
) -> WiggleVerdict:
    """``camera`` spoils the calibration, ``reported`` the arm's motions, ``tcp`` its frame."""
    truth, rng = random_truth(seed), np.random.default_rng(seed)
    frame = np.eye(4) if tcp is None else tcp
    first = truth.tool_looking(0.4, 0.2, 1.0, 0.3)
    wiggles = []
    for axis, step in enumerate(wiggle_steps()):
        moved = se3.exp(step)
        before, after = (view(truth, T, rng, 0.05) for T in (first, first @ moved))
        wiggles.append(
            Wiggle(
                axis,
                PosedView(before, first @ frame),
                PosedView(after, first @ reported(moved) @ frame),
            )
        )
    return judge_wiggles(wiggles, camera(truth.T_tool_camera), truth.intrinsics)


def rescaled(factors: list[float]) -> Change:
    return lambda T: se3.exp(se3.log(T) * np.array(factors))


def test_a_right_calibration_passes_without_findings() -> None:
    for seed in range(10):
        found = verdict(seed)
        assert found.passed
        assert found.findings == ()
        assert all(one.mismatch_px < 0.3 < one.motion_px for one in found.results)


def test_a_wrong_sign_is_named() -> None:
    found = verdict(reported=rescaled([-1, 1, 1, 1, 1, 1]))
    assert not found.passed
    assert found.findings[0].startswith("moving along +x looks like −x")


def test_a_wrong_sense_of_rotation_is_named() -> None:
    found = verdict(reported=rescaled([1, 1, 1, 1, 1, -1]))
    assert found.findings[0].startswith("turning about +z looks like −z")


def test_exchanged_axes_are_named() -> None:
    found = verdict(reported=lambda T: se3.exp(se3.log(T)[[1, 0, 2, 3, 4, 5]]))
    assert "moving along +x looks like +y, moving along +y looks like +x" in found.findings[0]


def test_a_tool_frame_turned_by_a_quarter_is_named() -> None:
    found = verdict(tcp=transform([0, 0, 0], [0, 0, np.pi / 2]))
    assert "+x looks like +y, moving along +y looks like −x" in found.findings[0]
    assert "frame is turned" in found.findings[0]


def test_a_camera_turned_on_its_mount_is_measured() -> None:
    found = verdict(camera=lambda X: X @ transform([0, 0, 0], [0, 0, np.radians(5)]))
    assert "turned against the calibration by 5.0°" in found.findings[0]


def test_a_wrong_tool_centre_point_is_measured() -> None:
    found = verdict(tcp=transform([0, 0, 0.1], [0, 0, 0]))
    assert "TCP" in found.findings[0]
    numbers = [float(n) for n in found.findings[0].split("(")[1].split(")")[0].split(",")]
    assert numbers == pytest.approx([0, 0, -100], abs=1.0)


def test_wrong_units_are_named_with_their_ratio() -> None:
    found = verdict(reported=rescaled([1.1, 1.1, 1.1, 1, 1, 1]))
    assert "0.9" in found.findings[0]
    assert "unit of length" in found.findings[0]


def test_an_arm_that_did_not_move_is_refused() -> None:
    with pytest.raises(CalibrationError, match="reports a motion of only"):
        verdict(reported=lambda T: np.eye(4))


def test_a_frozen_image_is_recognised() -> None:
    truth, rng = random_truth(4), np.random.default_rng(4)
    first = truth.tool_looking(0.4, 0.2, 1.0, 0.3)
    seen: BoardView = view(truth, first, rng)
    wiggles = [
        Wiggle(axis, PosedView(seen, first), PosedView(seen, first @ se3.exp(step)))
        for axis, step in enumerate(wiggle_steps())
    ]
    found = judge_wiggles(wiggles, truth.T_tool_camera, truth.intrinsics)
    assert "hardly moves" in found.findings[0]
