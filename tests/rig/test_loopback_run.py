"""``rig run`` through the true drivers, against emulated devices in processes of their own."""

import json
from pathlib import Path

import pytest

from rig.exit_codes import ExitCode
from tests.rig.command_line import rig
from tests.rig.loopback_served import ArmKind, served

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("arm", ["ur", "grbl"])
def test_a_run_through_the_true_drivers_finds_the_radius(arm: ArmKind, tmp_path: Path) -> None:
    if arm == "ur":
        pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    with served(arm, tmp_path, small=False, for_s=120.0) as running:
        result = rig("run", *running.arguments(), "--json", "--out", str(tmp_path / "run"))
    assert result.exit_code == ExitCode.OK, result.stderr
    assert json.loads(result.stdout)["radius_m"] == pytest.approx(0.019, rel=1e-2)
