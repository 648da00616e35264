"""The emulated gantry in a child process, so that it keeps time whatever its client does."""

import subprocess
from pathlib import Path
from types import TracebackType
from typing import Self

from drivers.own_python import own_python
from sim_backend.loopback_grbl.control import ControlClient

_END_S = 5.0


class LoopbackGantryProcess:
    """A gantry at ``port``, with ``control`` over it; ends with the ``with`` block.

    ``arguments`` are those of ``python -m sim_backend.loopback_grbl``. Raises OSError when it
    does not start.
    """

    def __init__(self, port: Path, arguments: tuple[str, ...] = ()) -> None:
        self.port = port
        self._process = subprocess.Popen(
            [
                *(*own_python("sim_backend.loopback_grbl.__main__"), "--link", str(port)),
                *("--end-with-stdin", *arguments),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        assert self._process.stdout is not None and self._process.stderr is not None
        if self._process.stdout.readline().strip() != b"ready":
            said = self._process.stderr.read().decode(errors="replace").strip()
            self.close()
            raise OSError(f"the emulated gantry did not start: {said or 'it ended at once'}")
        self.control = ControlClient(port)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.control.close()
        self.close()

    def close(self) -> None:
        """End the process; harmless when repeated."""
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            if pipe is not None:
                pipe.close()
        try:
            self._process.wait(timeout=_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
