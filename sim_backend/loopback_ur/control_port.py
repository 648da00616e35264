"""The emulation's own port: JSON lines that order faults, stand for a person at the pendant,
and ask for the truth.
"""

import json
import math

import numpy as np

from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.faults import Faults, fault_kind
from sim_backend.loopback_ur.kinematics import transform
from sim_backend.loopback_ur.truth import ArmTruth

_MOST_ROWS = 5000  # ten seconds


class ControlPort:
    """Answers ``{"fault": kind, "after_s", "for_s"}``, ``{"do": "clear"}``,
    ``{"slider": fraction}``, ``{"tcp": [x, y, z, rx, ry, rz]}`` and
    ``{"get": "motion", "since_s"}``.
    """

    def __init__(self, controller: Controller, faults: Faults, truth: ArmTruth) -> None:
        self._controller = controller
        self._faults = faults
        self._truth = truth

    def answer(self, line: str) -> str:
        """A JSON object; ``error`` says what was wrong with the request."""
        try:
            request = json.loads(line)
            if not isinstance(request, dict):
                raise ValueError("a request is a JSON object")
            return json.dumps(self._reply(request))
        except (ValueError, TypeError, OverflowError, RecursionError) as error:
            return json.dumps({"error": str(error)})

    def _reply(self, request: dict[str, object]) -> dict[str, object]:
        if "fault" in request:
            after_s, for_s = (float(str(request.get(key, 0.0))) for key in ("after_s", "for_s"))
            self._faults.order(fault_kind(str(request["fault"])), after_s, for_s)
            return {"ok": True}
        if request.get("do") == "clear":
            self._faults.clear()
            return {"ok": True}
        if "slider" in request:
            self._controller.set_slider(float(str(request["slider"])))
            return {"ok": True}
        if "tcp" in request:
            self._controller.motion.set_tool(transform(_pose(request["tcp"])))
            return {"ok": True}
        if request.get("get") == "motion":
            return {"motion": self._motion(float(str(request.get("since_s", 0.0))))}
        raise ValueError("known requests: fault, do: clear, slider, tcp, get: motion")

    def _motion(self, since_s: float) -> list[list[float]]:
        """Rows (t_s, q (6), qd (6)) since an instant, at most the last ten seconds."""
        history = self._truth.history
        first = math.ceil((since_s - history.start_s) / history.step_s - 1e-6)
        numbers = np.arange(max(first, history.first, history.count - _MOST_ROWS), history.count)
        q, qd = history.entries(numbers)
        times = history.start_s + numbers * history.step_s
        rows: list[list[float]] = np.column_stack([times, q, qd]).tolist()
        return rows


def _pose(value: object) -> tuple[float, ...]:
    """Six finite numbers; raises ValueError for anything else."""
    pose = tuple(float(str(part)) for part in value) if isinstance(value, list) else ()
    if len(pose) != 6 or not np.all(np.isfinite(pose)):
        raise ValueError(f"a TCP is six numbers (x, y, z, rx, ry, rz), not {value!r}")
    return pose
