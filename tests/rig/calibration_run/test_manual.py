"""``rig calibrate --manual`` on a terminal: what it shows, what keys do, what comes out."""

import json
import os
import pty
import re
import select
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import WallClock
from tests.rig.calibration_run.small_rig import SMALL, calibrate
from tests.rig.command_line import RIG

CLOCK = WallClock()
PATIENCE_S = 240.0
# From pose to pose: tilts to both sides, rolls, nearer, aside; 2 and 3 choose the size of steps.
POSES = (
    *("", "3j", "ll", "ji", "kk", "i2oooo", "pppppppp"),
    *("oooo3ff", "2dddw", "aaaaaas", "dddwww", "ssssss"),
)


class Terminal:
    """The command with a terminal of its own; standard output goes to a file."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self._screen, slave = pty.openpty()
        self._said = ""
        self._seen = 0
        self._out = folder / "out.json"
        with self._out.open("wb") as out:
            self.process = subprocess.Popen(
                [*RIG, "calibrate", "--manual", "--json", *arguments]
                + [f"--set={one}" for one in SMALL],
                cwd=folder,
                stdin=slave,
                stdout=out,
                stderr=slave,
                env={**os.environ, "TERM": "xterm", "COLUMNS": "200", "LINES": "50"},
                start_new_session=True,
            )
        os.close(slave)

    def press(self, keys: str) -> None:
        os.write(self._screen, keys.encode())

    def wait_for(self, pattern: str) -> str:
        """What matched, in what was said since the last match."""
        give_up_s = CLOCK.now_s() + PATIENCE_S
        while not (found := re.search(pattern, self._said[self._seen :])):
            ended = self.process.poll() is not None
            assert not ended and CLOCK.now_s() < give_up_s, f"{pattern}? {self._said[-2000:]}"
            self._read()
        self._seen += found.end()
        return found.group(0)

    def finish(self) -> tuple[int, str, str]:
        """Exit status, standard output, everything said."""
        give_up_s = CLOCK.now_s() + PATIENCE_S
        while self.process.poll() is None:
            assert CLOCK.now_s() < give_up_s, self._said[-2000:]
            self._read()
        self._read()
        return self.process.returncode, self._out.read_text(encoding="utf-8"), self._said

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        os.close(self._screen)

    def _read(self) -> None:
        while select.select([self._screen], [], [], 0.05)[0]:
            try:
                self._said += os.read(self._screen, 65536).decode(errors="replace")
            except OSError:
                return


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    made = Terminal(tmp_path, "--set", "calibration.plan.limits.max_distance_m=0.6")
    yield made
    made.close()


@pytest.mark.slow
def test_keys_move_and_take_pictures_until_there_is_enough(
    terminal: Terminal, tmp_path: Path
) -> None:
    terminal.wait_for(r"board: 24 corners")
    terminal.wait_for(r"next: show the whole board")
    for number, keys in enumerate(POSES, start=1):
        for key in keys:
            terminal.press(key)
            terminal.wait_for(rf"moved \({key}\)")
        terminal.press("c")
        terminal.wait_for(rf"captured: pose {number}\b")
    terminal.wait_for(r"there: .*left tilted nearer.*rolled clockwise")
    terminal.press("q")
    code, out, said = terminal.finish()
    assert code == 0, said
    found = json.loads(out)
    assert found["hand_eye"]["T_tool_camera"][:3] == pytest.approx([0.03, -0.02, 0.06], abs=2e-3)
    assert "latency is missing" in " ".join(found["reasons"])
    assert "next: tilt the camera until the" in said


@pytest.mark.slow
def test_a_picture_is_taken_back_and_ctrl_c_keeps_the_rest(
    terminal: Terminal, tmp_path: Path
) -> None:
    terminal.wait_for(r"board: 24 corners")
    terminal.press("cu")
    terminal.wait_for(r"taken back: 0 poses left")
    terminal.press("c3j")
    terminal.wait_for(r"moved \(j\)")
    terminal.press(" x")
    terminal.wait_for(r"'x' is no key here")
    os.killpg(terminal.process.pid, signal.SIGINT)
    code, _, said = terminal.finish()
    assert code == 130
    assert "kept: 2 poses" in said
    stills = (tmp_path / "calibration" / "sim-data").glob("still-*.npz")
    assert len(list(stills)) == 2


def test_without_a_terminal_there_are_no_keys(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with open(os.devnull) as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        done = calibrate("--manual")
    assert done.exit_code == 2
    assert "terminal" in done.stderr
