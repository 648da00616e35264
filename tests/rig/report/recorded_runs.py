"""Short runs on the simulated rig, recorded as `rig run` records them."""

import json
from pathlib import Path

from tests.rig.command_line import rig


def record(out: Path, *arguments: str, target: str = "sphere") -> dict:
    """Run for a second and a half into ``out``; its summary."""
    short = ("--duration", "1.5", "--set", "sim.renderer=raster")
    result = rig("run", "--target", target, "--json", "--out", str(out), *short, *arguments)
    assert result.exit_code == 0, result.stderr
    return json.loads((out / "summary.json").read_text())
