"""Starts the loopback controller as a process, orders faults and reads the truth from outside."""

import json
import socket
import subprocess
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drivers.own_python import own_python
from sim_backend.loopback_ur.kinematics import pose_and_jacobian
from sim_backend.loopback_ur.server import CONTROL_PORT

FloatArray = NDArray[np.float64]


class LoopbackControl:
    """A connection to a running loopback controller's own port."""

    def __init__(self, host: str, timeout_s: float = 5.0) -> None:
        self._socket = socket.create_connection((host, CONTROL_PORT), timeout_s)
        self._file = self._socket.makefile("rw", encoding="utf-8")

    def fault(self, kind: str, after_s: float = 0.0, for_s: float = 0.0) -> None:
        """Order a fault; raises ValueError when the controller does not know it."""
        self._ask({"fault": kind, "after_s": after_s, "for_s": for_s})

    def clear(self) -> None:
        """End lasting faults and release the emergency button."""
        self._ask({"do": "clear"})

    def slider(self, fraction: float) -> None:
        """Move the pendant's speed slider."""
        self._ask({"slider": fraction})

    def tcp(self, pose: tuple[float, ...]) -> None:
        """Choose another tool centre point (x, y, z, rx, ry, rz) at the pendant."""
        self._ask({"tcp": list(pose)})

    def motion(self, since_s: float = 0.0) -> FloatArray:
        """Rows (t_s, q (6), qd (6)), every 2 ms since an instant of the monotonic clock."""
        rows = self._ask({"get": "motion", "since_s": since_s})["motion"]
        return np.array(rows).reshape(-1, 13)

    def tool_speeds(self, since_s: float = 0.0) -> FloatArray:
        """Rows (t_s, v (3), ω (3)) of the flange in base axes since an instant."""
        rows = self.motion(since_s)
        twists = [pose_and_jacobian(row[1:7], np.eye(4))[1] @ row[7:] for row in rows]
        return np.column_stack([rows[:, 0], np.array(twists)])

    def close(self) -> None:
        """Hang up."""
        self._file.close()
        self._socket.close()

    def _ask(self, request: dict[str, object]) -> dict[str, Any]:
        self._file.write(json.dumps(request) + "\n")
        self._file.flush()
        reply: dict[str, Any] = json.loads(self._file.readline())
        if "error" in reply:
            raise ValueError(reply["error"])
        return reply


class LoopbackProcess:
    """The loopback controller in a child process; ends with the ``with`` block or its parent.

    Raises OSError when its ports are taken.
    """

    def __init__(
        self,
        host: str,
        lifetime_s: float = 300.0,
        unlock_after_s: float = 5.0,
        tcp_offset: tuple[float, ...] = (0.0,) * 6,
        q_start: tuple[float, ...] | None = None,
        version: str | None = None,
    ) -> None:
        self.host = host
        command = [*own_python("sim_backend.loopback_ur.__main__"), "--host", host]
        command += ["--lifetime-s", str(lifetime_s), "--unlock-after-s", str(unlock_after_s)]
        command += ["--end-with-stdin", f"--tcp-offset={_comma(tcp_offset)}"]
        if q_start is not None:
            command += [f"--q-start={_comma(q_start)}"]
        if version is not None:
            command += ["--version", version]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        assert self._process.stdout is not None and self._process.stderr is not None
        if self._process.stdout.readline().strip() != b"ready":
            said = self._process.stderr.read().decode(errors="replace").strip()
            self.close()
            raise OSError(f"the loopback controller did not start: {said}")
        self.control = LoopbackControl(host)

    @property
    def pid(self) -> int:
        """The controller's process id."""
        return self._process.pid

    def close(self) -> None:
        """End the process; harmless when repeated."""
        if hasattr(self, "control"):
            self.control.close()
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None:
                stream.close()
        try:
            self._process.wait(3.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def _comma(values: tuple[float, ...]) -> str:
    return ",".join(repr(float(value)) for value in values)
