"""The whole ``rig run`` on the wall clock: control keeps its time, and vision may die."""

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.bench_lateness import compare
from tests.rig.command_line import RIG
from tests.rig.log_lines import log_lines
from tests.rig.vision.discs import CLOCK

pytestmark = pytest.mark.slow

ENDS_WITHIN_S = 60.0


@pytest.fixture
def run(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A run of the simulated rig on the wall clock that has begun to see its target."""
    out = tmp_path / "run"
    options = ["--target", "sphere", "--realtime", "--json", "--duration", "120"]
    slow = ["--set", "motion.velocity_m_s=[-0.004,0,0]", "--set", "sim.renderer=raster"]
    process = subprocess.Popen(
        [*RIG, "run", *options, *slow, "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr is not None
        for line in process.stderr:
            if "target tracking" in line:
                break
        yield process
    finally:
        process.kill()
        process.communicate()


def vision_process_of(pid: int) -> int:
    """The child that measures."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    commands = {int(child): Path(f"/proc/{child}/cmdline").read_text() for child in children}
    return next(child for child, command in commands.items() if "rig.vision.child" in command)


def test_a_run_whose_vision_dies_stops_the_arm_and_says_so(
    run: subprocess.Popen[str], tmp_path: Path
) -> None:
    os.kill(vision_process_of(run.pid), signal.SIGKILL)
    killed_s = CLOCK.now_s()
    stdout, stderr = run.communicate(timeout=ENDS_WITHIN_S)
    assert run.returncode == 3, stderr
    assert "the process that reads the camera and measures died" in stderr
    assert json.loads(stdout)["radius_m"] is None
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["arm_at_rest"]
    log = log_lines(tmp_path / "run")
    noticed_s = next(line["t_s"] for line in log if "died" in line.get("detail", ""))
    assert noticed_s - killed_s < 0.1


def test_a_killed_run_takes_its_vision_with_it(run: subprocess.Popen[str]) -> None:
    vision = vision_process_of(run.pid)
    run.kill()
    deadline_s = CLOCK.now_s() + 5.0
    while Path(f"/proc/{vision}").exists():
        assert CLOCK.now_s() < deadline_s, "the vision process lives on"
        CLOCK.sleep_until(CLOCK.now_s() + 0.01)


@pytest.mark.parametrize("kind", ["sim", "ur"])
def test_the_loop_is_hardly_later_than_a_bare_one_and_no_command_is_missed(kind: str) -> None:
    if kind == "ur":
        pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    found = compare(kind, 60.0, ["sim.renderer=raster"] if kind == "sim" else [])
    assert found.ratio <= 3.0
    assert found.missed == 0
