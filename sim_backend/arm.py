"""The simulated gantry behind the ``Arm`` interface."""

import numpy as np
from numpy.typing import NDArray

from drivers.errors import OperateError
from drivers.interfaces import ArmState, Joints
from sim_backend.config import ArmConfig
from sim_backend.jit import jit
from sim_backend.kinematics import JOINT_HIGH, JOINT_LOW, tool_jacobian, tool_pose, tool_twist
from sim_backend.world import World

FloatArray = NDArray[np.float64]

_JOINT_NAMES = ("x", "y", "z", "roll", "pitch", "spin")
_LINEAR = (True, True, True, False, False, False)
_STEPS_PER_SAMPLE = 2  # of 1 ms: the controller reports at 500 Hz
_TURNED_RAD = 0.02  # changes a twist's covariance by as little


class SimulatedArm:
    """The gantry as its controller shows it: late, quantised and a little noisy."""

    def __init__(self, config: ArmConfig, world: World, seed: int) -> None:
        self._world = world
        self._delay_s = config.report_delay_s
        self._steps = np.repeat([config.encoder_step_m, config.encoder_step_rad], 3).astype(float)
        self._noise = np.repeat([config.noise_m_s, config.noise_rad_s], 3).astype(float)
        self._random = np.random.default_rng([seed, 1])
        self._next = 0  # number of the first sample not returned yet
        self._closed = False
        self._q: FloatArray | None = None  # (6,) joints at the newest reported sample
        self._noise_at: tuple[FloatArray, FloatArray] | None = None  # those joints, covariance
        # Compiles the kernels now rather than in the middle of a run.
        _measure(np.zeros((1, 6)), np.zeros((1, 6)), np.zeros((1, 6)), self._steps)

    def read_states(self) -> list[ArmState]:
        """Every sample reported since the last call, oldest first.

        After more than two minutes without a call the oldest samples are lost.
        """
        history = self._world.history
        newest_s = self._world.sync() - self._delay_s
        ripe = (newest_s - history.start_s) / (history.step_s * _STEPS_PER_SAMPLE)
        last = int(np.floor(ripe + 1e-6))
        if last < self._next:
            return []
        # The noise is drawn for lost samples as well: the stream stays tied to their numbers.
        noise = self._random.standard_normal((last + 1 - self._next, 6)) * self._noise
        numbers = np.arange(self._next, last + 1) * _STEPS_PER_SAMPLE
        self._next = last + 1
        kept = numbers >= history.first
        numbers, noise = numbers[kept], noise[kept]
        q, qd = history.entries(numbers)
        self._q = q[-1]
        covariance = self._covariance(self._q)
        poses, twists = _measure(q, qd, noise, self._steps)
        times = history.start_s + numbers * history.step_s
        return [
            ArmState(float(t), T_base_tool=T, twist_tool=twist, twist_covariance=covariance)
            for t, T, twist in zip(times, poses, twists, strict=True)
        ]

    def _covariance(self, q: FloatArray) -> FloatArray:
        """Of the newest twists (6, 6): the joints' noise, a new one once the wrist has turned."""
        if self._noise_at is None or np.abs(q - self._noise_at[0])[3:].max() > _TURNED_RAD:
            spread = tool_jacobian(q) * self._noise
            self._noise_at = q, spread @ spread.T
        return self._noise_at[1]

    def joints(self) -> Joints | None:
        """The joints at the newest reported sample; None before the first."""
        if self._q is None:
            return None
        return joints_at(self._q)

    def command_twist(self, twist_tool: FloatArray, hold_s: float) -> None:
        """Follow ``twist_tool`` (6,), held in the tool's own axes, for ``hold_s`` from now.

        Raises OperateError, after a stop, for a command that is not six finite numbers and a
        finite hold time, or after ``close``.
        """
        twist = np.asarray(twist_tool, dtype=float)
        if self._closed:
            raise OperateError("simulated arm: command after close; build the rig again")
        if twist.shape != (6,) or not np.all(np.isfinite(twist)) or not 0.0 <= hold_s < np.inf:
            self.stop()
            raise OperateError(
                f"simulated arm: refused the twist {twist.tolist()} for {hold_s!r} s and stopped; "
                "a command is six finite numbers and a finite hold time"
            )
        self._world.command(twist, hold_s)

    def tcp_offset(self) -> None:
        """Nothing: where the tool is follows from the configuration."""

    def stop(self) -> None:
        """Ramp to standstill at the acceleration limits."""
        self._world.command(np.zeros(6), 0.0)

    def close(self) -> None:
        """Stop; later commands are refused."""
        self.stop()
        self._closed = True


def joints_at(q: FloatArray) -> Joints:
    """The gantry's joints at ``q`` (6,)."""
    return Joints(_JOINT_NAMES, q, JOINT_LOW, JOINT_HIGH, _LINEAR, tool_jacobian)


@jit
def _measure(
    q: FloatArray, qd: FloatArray, noise: FloatArray, steps: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Poses (m, 4, 4) by quantised encoders and twists (m, 6) by noisy joint velocities."""
    m = q.shape[0]
    poses, twists = np.empty((m, 4, 4)), np.empty((m, 6))
    for k in range(m):
        seen = q[k].copy()
        for i in range(6):
            if steps[i] > 0.0:
                seen[i] = np.floor(seen[i] / steps[i] + 0.5) * steps[i]
        poses[k] = tool_pose(seen)
        twists[k] = tool_twist(seen, qd[k] + noise[k])
    return poses, twists
