"""A run on the wall clock with its live page, and what it left when it was over."""

import json
import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Thread

import numpy as np

from tests.rig.command_line import RIG
from tests.rig.log_lines import log_lines

LIMIT_S = 120.0
_REDUCED = 0.9


@dataclass
class WatchedRun:
    """A simulated rig in real time, in a process of its own."""

    url: str
    out: Path
    process: subprocess.Popen

    def end(self) -> tuple[int, dict]:
        """Its exit status and what it printed."""
        output, _ = self.process.communicate(timeout=LIMIT_S)
        return self.process.returncode, json.loads(output)

    def first_reduced_s(self) -> float:
        """When the first command of the ramp was sent that is a tenth slower, or more."""
        entries = log_lines(self.out)
        ramp = next(n for n, entry in enumerate(entries) if entry.get("event") == "state stopping")
        before = [entry for entry in entries[:ramp] if entry["kind"] == "command"][-1]
        speed = np.linalg.norm(before["allowed"][:3])
        after = (entry for entry in entries[ramp:] if entry["kind"] == "command")
        reduced = (e for e in after if np.linalg.norm(e["allowed"][:3]) < _REDUCED * speed)
        return next(reduced)["t_s"]


@contextmanager
def watched_run(out: Path, *arguments: str) -> Iterator[WatchedRun]:
    """Start it and wait for the page's address; it is killed if it is still there at the end."""
    process = subprocess.Popen(
        [
            *(*RIG, "run", "--target", "sphere", "--realtime", "--duration", "100", "--json"),
            *("--view", "--no-report", "--out", str(out), "--set", "sim.renderer=raster"),
            # Slow, so that the target stays in reach for as long as a browser takes.
            *("--set", "motion.velocity_m_s=[-0.01, 0, 0]", *arguments),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr is not None
        said = []
        for line in process.stderr:
            said.append(line)
            found = re.match(r"live page: (\S+)", line)
            if found:
                break
        else:
            raise AssertionError("".join(said))
        rest = Thread(target=process.stderr.read, daemon=True)  # or it would wait for its reader
        rest.start()
        yield WatchedRun(found.group(1), out, process)
    finally:
        process.kill()
        process.wait()
