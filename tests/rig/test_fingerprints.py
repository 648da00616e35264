"""What makes a calibration out of date, and what does not."""

from copy import deepcopy

import pytest

from rig.config_load import configured
from rig.fingerprints import fingerprints

REAL = {
    "camera": {"driver": "opencv", "source": "/dev/video7", "width": 640, "height": 480},
    "arm": {"driver": "ur", "host": "192.0.2.1"},
}
GANTRY = {
    "camera": REAL["camera"],
    "arm": {
        "driver": "grbl",
        "port": "/dev/ttyACM0",
        "axes": [{"letter": axis.upper(), "joint": axis, "mpos_max": 0.0} for axis in "xyz"],
    },
}
AXES = "arm.axes=[{letter: X, joint: x%s}, {letter: Y, joint: y}, {letter: Z, joint: z}]"


def changed(tree: dict[str, object], *assignments: str) -> set[str]:
    before = fingerprints(configured(deepcopy(tree), [], "test"))
    now = fingerprints(configured(deepcopy(tree), list(assignments), "test"))
    return {name for name in now if now[name] != before[name]}


@pytest.mark.parametrize(
    ("tree", "assignment", "expected"),
    [
        (REAL, "camera.source=/dev/video8", {"camera"}),
        (REAL, "camera.rate_hz=60", {"camera"}),
        (REAL, "camera.fourcc=MJPG", {"camera"}),
        (REAL, "camera.controls.focus=30", {"camera"}),
        (REAL, "camera.controls.exposure_ms=3", {"camera"}),
        (REAL, "camera.transfer_s=0.01", {"camera"}),
        (REAL, "camera.assumed_exposure_s=0.01", {"camera"}),
        (REAL, "calibration.board.square_m=0.05", {"board"}),
        (GANTRY, "arm.wrist.tool_xyz_m=[0,0,-0.06]", {"arm"}),
        (GANTRY, AXES % ", sign: -1", {"arm"}),
        (GANTRY, AXES % ", mpos_at_zero: -2", {"arm"}),
        ({}, "sim.camera.width=320", {"camera"}),
    ],
)
def test_what_images_and_poses_follow_from_makes_a_calibration_stale(
    tree: dict[str, object], assignment: str, expected: set[str]
) -> None:
    assert changed(tree, assignment) == expected


@pytest.mark.parametrize(
    ("tree", "assignment"),
    [
        (REAL, "camera.give_up_after_s=5"),
        (REAL, "camera.select_timeout_s=3"),
        (REAL, "camera.max_age_s=1"),
        (REAL, "camera.method=moments"),
        (REAL, "arm.connect_timeout_s=60"),
        (REAL, "arm.watchdog_hz=20"),
        (REAL, "arm.host=192.0.2.2"),
        (GANTRY, "arm.port=/dev/ttyACM1"),
        (GANTRY, "arm.poll_hz=30"),
        (GANTRY, "arm.self_test_mm=1"),
        (GANTRY, AXES % ", mpos_min: -300"),
        (GANTRY, "safety.max_linear_speed_m_s=0.06"),
        ({}, "sim.camera.fx=700"),  # the truth is for the calibration to find
    ],
)
def test_patience_addresses_and_limits_do_not(tree: dict[str, object], assignment: str) -> None:
    assert changed(tree, assignment) == set()


def test_another_arm_does() -> None:
    ur, gantry = (fingerprints(configured(deepcopy(tree), [], "test")) for tree in (REAL, GANTRY))
    assert ur["arm"] != gantry["arm"]
    assert ur["camera"] == gantry["camera"]
