"""Runs checks in a worker process and watches it: every check ends as a row, in bounded time."""

import contextlib
import json
import os
import select
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from drivers.clock import Clock
from drivers.own_python import own_python
from rig.doctor.checks import Check
from rig.doctor.finding import Finding, Status, finding_of
from rig.doctor.subject import Subject

# A worker has this long to start: it imports the configuration's classes.
_START_S = 120.0
_LOOK_S = 0.1
_END_S = 2.0
_SAID_BYTES = 300


def run_checks(
    subject: Subject,
    checks: Sequence[Check],
    clock: Clock,
    on_begin: Callable[[str], None] = lambda name: None,
    stop_requested: Callable[[], bool] = lambda: False,
) -> Iterator[Finding]:
    """One finding per check, in order; ``on_begin`` hears the name of the one that starts.

    A check that hangs past its limit or takes its process down becomes a failed row, and the
    rest goes on in a new process. ``stop_requested`` ends it between two findings, and ends
    the check under way; nothing is left running.
    """
    left = list(checks)
    while left and not stop_requested():
        worker = _Worker(subject, left)
        try:
            for finding in _listen(worker, left, clock, on_begin, stop_requested):
                left.pop(0)
                yield finding
        finally:
            worker.kill()


def _listen(
    worker: "_Worker",
    checks: Sequence[Check],
    clock: Clock,
    on_begin: Callable[[str], None],
    stop_requested: Callable[[], bool],
) -> Iterator[Finding]:
    """Findings until all are there, one check was the worker's last, or a stop was requested."""
    for check in list(checks):
        deadline_s = clock.now_s() + _START_S
        while True:
            message = worker.read(_LOOK_S)
            if stop_requested():
                return
            if message is None:
                if worker.alive() and clock.now_s() < deadline_s:
                    continue
                yield _no_result(check, worker)
                return
            if "finding" in message:
                break
            on_begin(check.name)
            deadline_s = clock.now_s() + check.limit_s
        yield finding_of(message["finding"])


def _no_result(check: Check, worker: "_Worker") -> Finding:
    """The row of a check that gave none."""
    how = worker.death()
    if how is None:
        text = f"no result within {check.limit_s:g} s: what it asks hangs"
        advice = "unplug and plug in the device, look at `dmesg`, then try again"
    else:
        text = f"the check's process died{how}"
        advice = "a driver or library crashes on this machine: update or reinstall it"
    return Finding(check.name, Status.FAIL, text, advice)


class _Worker:
    """A running worker."""

    def __init__(self, subject: Subject, checks: Sequence[Check]) -> None:
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        # For what checks write: removed with the process, however that ends.
        self._scratch = tempfile.TemporaryDirectory(prefix="activerig-", ignore_cleanup_errors=True)
        self._results, theirs = os.pipe()
        self._held = b""
        self._ended = False
        try:
            self._process = subprocess.Popen(
                # Not -m, which would search the current directory before this program's own.
                [*own_python("rig.doctor.worker", "run"), str(theirs)],
                stdin=subprocess.PIPE,
                stdout=self._output,
                stderr=self._output,
                env={**os.environ, "TMPDIR": self._scratch.name},
                pass_fds=(theirs,),
                # A session of its own: Ctrl-C is for the parent, and all of it can be ended.
                start_new_session=True,
            )
        finally:
            os.close(theirs)
        request = {
            "subject": subject.as_json(),
            "checks": [(check.name, check.entry) for check in checks],
        }
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it died at once: read() will tell
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
            self._process.stdin.flush()

    def read(self, timeout_s: float) -> dict[str, Any] | None:
        """The next message; None when none came in time, or none will come any more."""
        while b"\n" not in self._held:
            readable, _, _ = select.select([self._results], [], [], timeout_s)
            data = os.read(self._results, 65536) if readable else b""
            if not data:
                self._ended = bool(readable)
                return None
            self._held += data
        line, _, self._held = self._held.partition(b"\n")
        message: dict[str, Any] = json.loads(line)
        return message

    def alive(self) -> bool:
        """Whether it may still say something."""
        return not self._ended

    def death(self) -> str | None:
        """How the worker died, and its last words; None while it lives."""
        if not self._ended:
            return None
        try:
            status = self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            return ""
        with contextlib.suppress(ValueError):
            return f" ({signal.Signals(-status).name}){self._said()}"
        return f" (exit status {status}){self._said()}"

    def kill(self) -> None:
        """End the worker and what it started."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        # One that hangs inside the kernel stays; it must not keep the others waiting.
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_S)
        if self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()
        os.close(self._results)
        self._output.close()
        self._scratch.cleanup()

    def _said(self) -> str:
        size = self._output.seek(0, os.SEEK_END)
        self._output.seek(max(0, size - _SAID_BYTES))
        lines = self._output.read().decode(errors="replace").splitlines()
        words = [line.strip() for line in lines if line.strip()]
        return f": {words[-1]}" if words else ""
