import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.grbl.kinematics import GantryKinematics
from drivers.grbl.settings import AxisSettings, WristSettings, standard_axes
from sim_backend import kinematics as simulated
from tests.drivers.grbl.simulated import WRIST

FloatArray = NDArray[np.float64]

SIX = GantryKinematics(standard_axes(6), WRIST)
RANDOM = np.random.default_rng(5)
JOINTS = [RANDOM.uniform(-1.0, 1.0, 6) for _ in range(12)]


@pytest.mark.parametrize("q", JOINTS)
def test_the_standard_wrist_is_that_of_the_simulated_rig(q: FloatArray) -> None:
    qd = RANDOM.uniform(-1.0, 1.0, 6)
    assert SIX.tool_pose(q) == pytest.approx(simulated.tool_pose(q), abs=1e-12)
    assert SIX.tool_twist(q, qd) == pytest.approx(simulated.tool_twist(q, qd), abs=1e-12)


def odd_wrist() -> GantryKinematics:
    return GantryKinematics(
        standard_axes(6),
        WristSettings(
            centre_xyz_m=(0.1, -0.2, 0.5),
            roll_axis=(0.8, 0.6, 0.0),
            pitch_axis=(-0.6, 0.8, 0.0),
            spin_axis=(0.0, 0.28, 0.96),
            tool_xyz_m=(0.03, 0.01, -0.07),
            tool_rotvec_rad=(0.3, -0.2, 1.0),
        ),
    )


@pytest.mark.parametrize("q", JOINTS)
def test_the_twist_is_the_derivative_of_the_pose(q: FloatArray) -> None:
    gantry, h = odd_wrist(), 1e-6
    qd = RANDOM.uniform(-1.0, 1.0, 6)
    before, after = gantry.tool_pose(q - h * qd), gantry.tool_pose(q + h * qd)
    R = gantry.tool_pose(q)[:3, :3]
    v = R.T @ (after[:3, 3] - before[:3, 3]) / (2 * h)
    W = R.T @ (after[:3, :3] - before[:3, :3]) / (2 * h)
    expected = [*v, W[2, 1], W[0, 2], W[1, 0]]
    assert gantry.tool_twist(q, qd) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("q", JOINTS)
def test_joint_rates_make_the_twist_asked_for(q: FloatArray) -> None:
    gantry = odd_wrist()
    twist = RANDOM.uniform(-0.5, 0.5, 6)
    qd, missing = gantry.joint_rates(q, twist)
    assert gantry.tool_twist(q, qd) == pytest.approx(twist, abs=1e-9)
    assert missing == pytest.approx(np.zeros(3), abs=1e-9)


def test_in_the_singularity_joint_speeds_stay_bounded_and_the_tool_point_moves_as_asked() -> None:
    q = np.array([0.0, 0.0, 0.0, 0.3, np.pi / 2, 0.2])
    twist = np.array([0.1, -0.05, 0.02, 0.3, 0.3, 0.3])
    qd, missing = SIX.joint_rates(q, twist)
    assert np.abs(qd).max() < 20.0
    assert SIX.tool_twist(q, qd)[:3] == pytest.approx(twist[:3], abs=1e-9)
    assert np.linalg.norm(missing) > 0.05


def test_three_axes_translate_and_report_the_rotation_they_lack() -> None:
    gantry = GantryKinematics(standard_axes(3), WRIST)
    qd, missing = gantry.joint_rates(np.zeros(3), np.array([0.1, 0.2, 0.3, 0.0, 0.5, 0.0]))
    assert qd == pytest.approx([0.1, -0.2, -0.3])  # the tool looks down: y and z are turned
    assert np.linalg.norm(missing) == pytest.approx(0.5)


def test_a_four_axis_gantry_makes_the_rotation_it_has() -> None:
    axes = (*standard_axes(3), AxisSettings(letter="A", joint="spin"))
    gantry = GantryKinematics(axes, WRIST)
    twist = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.5])
    qd, missing = gantry.joint_rates(np.array([0.0, 0.0, 0.0, 0.7]), twist)
    assert qd == pytest.approx([0.0, 0.0, 0.0, -0.5])
    assert np.linalg.norm(missing) == pytest.approx(0.0, abs=1e-12)


def test_units_signs_and_zeros_of_the_controller() -> None:
    axes = (
        AxisSettings(letter="Y", joint="x", sign=-1, mpos_at_zero=-100.0),
        AxisSettings(letter="X", joint="y"),
        AxisSettings(letter="Z", joint="z"),
        AxisSettings(letter="C", joint="roll", mpos_at_zero=90.0),
    )
    gantry = GantryKinematics(axes, WRIST)
    q = gantry.joints(np.array([-350.0, 20.0, 0.0, 135.0]))
    assert q == pytest.approx([0.25, 0.02, 0.0, np.pi / 4])
    qd = np.array([0.1, 0.0, -0.2, 0.3])
    rates = gantry.axis_rates_of(qd)
    assert rates == pytest.approx([-100.0, 0.0, -200.0, np.rad2deg(0.3)])
    assert gantry.joint_rates_of(rates) == pytest.approx(qd)


@pytest.mark.parametrize("axes", [3, 4, 5, 6])
def test_the_jacobian_is_the_map_from_joint_rates_to_the_tools_twist(axes):
    wrist = WristSettings(tool_xyz_m=(0.03, -0.02, -0.05), tool_rotvec_rad=(2.0, 0.4, 0.1))
    kinematics = GantryKinematics(standard_axes(axes), wrist)
    rng = np.random.default_rng(axes)
    q, qd = rng.normal(size=axes), rng.normal(size=axes)
    assert kinematics.tool_jacobian(q) @ qd == pytest.approx(kinematics.tool_twist(q, qd))
