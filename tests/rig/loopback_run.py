"""``rig run`` in a process of its own against a served rig: what it did and what it left."""

import json
import os
import signal
import subprocess
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drivers.clock import WallClock
from tests.rig.command_line import RIG
from tests.rig.left_behind import MARK, processes_marked, shared_memory
from tests.rig.log_lines import log_lines
from tests.rig.loopback_served import Served

CLOCK = WallClock()
ENDS_WITHIN_S = 60.0
WATCHED_S = 1.5  # after an ending; the arm has stood for long by then
_MOVING_M_S = 0.03
_MOVING_TIMEOUT_S = 240.0


@dataclass(frozen=True)
class Result:
    """A run that has ended."""

    exit_code: int
    stdout: str
    stderr: str
    log: list[dict[str, Any]]
    summary: dict[str, Any] | None
    ended_s: float  # when the process was gone
    left_behind: list[str]  # processes and shared memory a second later

    def events(self) -> list[str]:
        """The names of the log's events in order."""
        return [line["event"] for line in self.log if line["kind"] == "event"]


class LoopbackRun:
    """A running ``rig run``; always end it with ``finish`` or ``kill``."""

    def __init__(
        self,
        rig: Served,
        out: Path,
        seed: int,
        extra: Sequence[str] = (),
        command: Sequence[str] = RIG,
        terminal: int | None = None,
        piped: bool = False,
    ) -> None:
        """Standard output goes to a file, or to a pipe if ``piped``.

        ``terminal``: the slave of a pty that becomes its controlling terminal and all its streams.
        """
        self._out = out
        self._mark = uuid.uuid4().hex
        self._shared = shared_memory()
        random = np.random.default_rng([seed, 31])
        speed_m_s = 0.05 * rig.way_back(random)
        arguments = [
            *(*command, "run", *rig.arguments(), "--out", str(out)),
            *("--set", "camera.rate_check_s=0.4"),
            *("--set", f"motion.velocity_m_s=[{speed_m_s}, 0.0, 0.0]", *extra),
        ]
        out.mkdir(parents=True, exist_ok=True)
        self._files = [(out / name).open("wb") for name in ("stdout", "stderr")]
        self._rig = rig
        self.process = subprocess.Popen(
            arguments,
            stdin=subprocess.DEVNULL if terminal is None else terminal,
            stdout=subprocess.PIPE if piped else self._files[0] if terminal is None else terminal,
            stderr=self._files[1] if terminal is None else terminal,
            env={**os.environ, "PYTHONUNBUFFERED": "1", MARK: self._mark},
            start_new_session=True,
            preexec_fn=None if terminal is None else _take_terminal,
        )

    def wait_until_moving(self) -> None:
        """Return as soon as the tool truly moves at more than half its speed."""
        give_up_s = CLOCK.now_s() + _MOVING_TIMEOUT_S
        while self._rig.speed_m_s() < _MOVING_M_S:
            assert self.process.poll() is None, self.said()
            assert CLOCK.now_s() < give_up_s, self.said()
            CLOCK.sleep_until(CLOCK.now_s() + 0.02)

    def wait_for_log(self, text: str, within_s: float) -> None:
        """Return as soon as the log holds ``text``."""
        give_up_s = CLOCK.now_s() + within_s
        while not any(text in json.dumps(line) for line in log_lines(self._out)):
            assert CLOCK.now_s() < give_up_s, f"no {text!r} in the log; {self.said()}"
            CLOCK.sleep_until(CLOCK.now_s() + 0.02)

    def processes(self, containing: str) -> list[int]:
        """Its own and its children's ids whose command line contains a text."""
        found = processes_marked(self._mark).items()
        return [pid for pid, command in found if containing in command]

    def said(self) -> str:
        """What it wrote to standard error so far."""
        path = self._out / "stderr"
        return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""

    def finish(self, within_s: float) -> Result:
        """Wait for the end, which has to come in time."""
        try:
            self.process.wait(within_s)
        except subprocess.TimeoutExpired:
            text = self.said()
            self.kill()
            raise AssertionError(f"it hangs; it said: {text}") from None
        ended_s = CLOCK.now_s()
        left: list[str] = []
        while CLOCK.now_s() < ended_s + 3.0:
            left = [*processes_marked(self._mark).values(), *self._shared.new_and_unused()]
            if not left:
                break
            CLOCK.sleep_until(CLOCK.now_s() + 0.1)
        self._close()
        return Result(
            exit_code=self.process.returncode,
            stdout=(self._out / "stdout").read_text(encoding="utf-8"),
            stderr=self.said(),
            log=log_lines(self._out),
            summary=_json(self._out / "summary.json"),
            ended_s=ended_s,
            left_behind=left,
        )

    def kill(self) -> None:
        """End it and all its children; harmless when it has ended."""
        self._close()
        for pid in processes_marked(self._mark):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self.process.wait()

    def _close(self) -> None:
        for file in self._files:
            file.close()


def ended(
    rig: Served, seed: int, out: Path, ready: Callable[[LoopbackRun], Callable[[], object]]
) -> tuple[float, Result]:
    """One run ended at a random moment of its motion; seconds to rest, and what it left.

    ``ready`` is called before that moment and returns what to do at it.
    """
    run = LoopbackRun(rig, out, seed, ["--json", "--duration", "30"])
    try:
        run.wait_until_moving()
        random = np.random.default_rng([seed, 43])
        CLOCK.sleep_until(CLOCK.now_s() + float(random.uniform(0.0, 0.8)))
        end = ready(run)
        begun_s = CLOCK.now_s()
        end()
        CLOCK.sleep_until(begun_s + WATCHED_S)
        rest_s = rig.last_motion_s(begun_s) - begun_s
        return rest_s, run.finish(ENDS_WITHIN_S)
    finally:
        run.kill()


def _take_terminal() -> None:
    import fcntl
    import termios

    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


def _json(path: Path) -> dict[str, Any] | None:
    if not path.is_file():
        return None
    read: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return read
