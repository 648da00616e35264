"""The physics: the gantry's dynamics in MuJoCo, advanced to the clock's present when asked."""

import math
import threading
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from sim_backend.config import ArmConfig
from sim_backend.drive import update_reference
from sim_backend.history import JointHistory
from sim_backend.mujoco_import import load_mujoco

FloatArray = NDArray[np.float64]

_REST_KEPT_S = 1.0  # more than a frame is late


class World:
    """The moving gantry on a clock.

    Nothing runs by itself: ``sync`` computes what happened since the last look, in steps of
    1 ms, so results depend on the commands and their instants alone. Safe for several threads.
    """

    def __init__(self, config: ArmConfig, q_start: FloatArray, clock: Clock) -> None:
        self.clock = clock
        self._lock = threading.Lock()
        self._mujoco = load_mujoco()
        self._model, self._data = load_gantry(config)
        self._step_s = float(self._model.opt.timestep)
        # Views into MuJoCo's state: asking for them costs more than using them.
        self._qpos, self._qvel = self._data.qpos, self._data.qvel
        self._qpos[:] = q_start
        self._max_speed = np.repeat(
            [config.max_slide_speed_m_s, config.max_wrist_speed_rad_s], 3
        ).astype(float)
        self._max_acceleration = np.repeat(
            [config.max_slide_acceleration_m_s2, config.max_wrist_acceleration_rad_s2], 3
        ).astype(float)
        self._reference = self._data.ctrl  # the joint velocities the drives are to follow
        self._twist_tool = np.zeros(6)
        self._expires_s = -math.inf
        # Compiles the kernel now rather than in the middle of a run; the reference stays zero.
        self._update_reference(np.zeros(6))
        self.history = JointHistory(clock.now_s(), self._step_s)
        self.history.append(q_start, np.zeros(6))

    def sync(self) -> float:
        """Advance to the clock's present, which is returned; the history then covers it."""
        now_s = self.clock.now_s()
        with self._lock:
            self._advance(now_s)
        return now_s

    def command(self, twist_tool: FloatArray, hold_s: float) -> None:
        """Follow ``twist_tool`` (6,) from the present on, for ``hold_s``."""
        now_s = self.clock.now_s()
        with self._lock:
            self._advance(now_s)
            self._twist_tool = np.array(twist_tool, dtype=float)
            self._expires_s = now_s + hold_s

    def skip_rest(self) -> None:
        """Go on as if the gantry had stood still for a second, before anybody looked or commanded.

        On the wall clock, where others took long to get ready: to compute a long standstill
        when the first of them looks would take long, too.
        """
        now_s = self.clock.now_s()
        with self._lock:
            if now_s - self.history.start_s < 2.0 * _REST_KEPT_S:
                return
            self.history = JointHistory(now_s - _REST_KEPT_S, self._step_s)
            for _ in range(round(_REST_KEPT_S / self._step_s)):
                self.history.append(self._qpos, np.zeros(6))

    def _advance(self, now_s: float) -> None:
        history, model, data, step = self.history, self._model, self._data, self._mujoco.mj_step
        # One step past the present: interpolation needs both ends. Reports of the arm are
        # delayed and frames lie in the past, so nobody sees this step early.
        wanted = math.ceil((now_s - history.start_s) / self._step_s - 1e-6) + 1
        half_step_s, at_rest = 0.5 * self._step_s, np.zeros(6)
        while history.count < wanted:
            t_s = history.time_s(history.count - 1)
            self._update_reference(self._twist_tool if t_s < self._expires_s else at_rest)
            step(model, data)
            # MuJoCo moves the position by the step's *final* velocity, so that velocity is
            # the one held half a step earlier: pair it with the position of that instant.
            history.append(self._qpos - half_step_s * self._qvel, self._qvel)

    def _update_reference(self, twist_tool: FloatArray) -> None:
        update_reference(
            self._reference,
            self._qpos,
            twist_tool,
            self._max_speed,
            self._max_acceleration,
            self._step_s,
        )


def load_gantry(config: ArmConfig) -> tuple[Any, Any]:
    """The MuJoCo model, its drives tuned to the configured time constants, and its state."""
    mujoco = load_mujoco()
    text = resources.files("sim_backend").joinpath("gantry.xml").read_text(encoding="utf-8")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    unit = np.zeros((6, 6))
    for i in range(6):  # columns of the mass matrix
        mujoco.mj_mulM(model, data, unit[i], np.eye(6)[i])
    gain = np.diag(unit) / np.repeat([config.slide_lag_s, config.wrist_lag_s], 3)
    model.actuator_gainprm[:, 0] = gain
    model.actuator_biasprm[:, 2] = -gain
    return model, data
