"""``rig run`` through the true drivers, against emulated devices in processes of their own."""

import json
import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rig.config_load import packaged_config
from tests.rig.command_line import rig

pytestmark = pytest.mark.slow

RIG = (sys.executable, "-c", "from rig.cli import main; main()")


@contextmanager
def served(*arguments: str) -> Iterator[str]:
    """``rig sim serve`` until the block ends; the stream's address."""
    process = subprocess.Popen(
        [
            *(*RIG, "sim", "serve", "--camera", "--port", "0", "--for", "120"),
            *(*arguments, "--set", "sim.renderer=raster"),
        ],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    try:
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.search(r"http://\S+?\.mjpg", line)
        assert found, line
        yield found.group(0)
    finally:
        process.terminate()
        try:
            process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def free_host() -> str:
    """A loopback address where nobody listens on the controller's ports."""
    for last in range(20, 250):
        host = f"127.0.3.{last}"
        with socket.socket() as probe:
            if probe.connect_ex((host, 30004)) != 0:
                return host
    raise AssertionError("no free loopback address")


def test_a_ur_through_its_vendors_package_finds_the_radius(tmp_path: Path) -> None:
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    host = free_host()
    with served("--arm", "ur", "--host", host) as stream:
        result = rig(
            *("run", "--target", "sphere", "--json", "--out", str(tmp_path)),
            *("--rig", str(packaged_config("loopback_ur5e.yaml"))),
            *("--set", f"arm.host={host}", "--set", f"camera.source={stream}"),
        )
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["radius_m"] == pytest.approx(0.019, rel=1e-2)


def test_a_serial_gantry_finds_the_radius(tmp_path: Path) -> None:
    link = tmp_path / "gantry"
    with served("--arm", "grbl", "--link", str(link), "--host", free_host()) as stream:
        result = rig(
            *("run", "--target", "sphere", "--json", "--out", str(tmp_path / "run")),
            *("--rig", str(packaged_config("loopback_gantry.yaml"))),
            *("--set", f"arm.port={link}", "--set", f"camera.source={stream}"),
        )
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["radius_m"] == pytest.approx(0.019, rel=1e-2)
