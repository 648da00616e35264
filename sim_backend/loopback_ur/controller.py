"""The emulated controller: one cycle of 2 ms after another, no sockets and no clock.

A controller of version 3 (CB3) looks at its registers and reports every fourth cycle only; the
arm stays a UR5e. Assumed: any stop of the program, also by the safety system, ends it (it must
be uploaded again); an emergency stop also cuts the power, and is released by a person at the
button; the reason of a protective stop is sent as a text to whoever listens.
"""

import numpy as np

from drivers.ur.rtde_codec import Value
from sim_backend.loopback_ur.config import ControllerConfig
from sim_backend.loopback_ur.kinematics import pose_vector, transform
from sim_backend.loopback_ur.motion import STEP_S, Motion
from sim_backend.loopback_ur.program import ControlProgram, watchdog_cycles
from sim_backend.loopback_ur.safety import (
    RobotMode,
    RuntimeState,
    SafetyMode,
    robot_status_bits,
    safety_status_bits,
)
from sim_backend.loopback_ur.variables import INPUTS, zero_of

_JOINT_RUNNING = 253
_MOST_TEXTS = 16


class Controller:
    """Registers, program, safety and motion; ``step`` is one cycle of 500 Hz."""

    def __init__(self, config: ControllerConfig, seed: int = 0) -> None:
        self.config = config
        self.cycle = 0
        # Cycles that a busy host still owes: what it reads now came during them, so the watchdog
        # of the emulated controller must not count them as silence.
        self.owed_cycles = 0
        self.safety_mode = SafetyMode.NORMAL
        self.robot_mode = RobotMode.RUNNING
        self.runtime = RuntimeState.STOPPED
        self._losing_power = False
        self.motion = Motion(
            config.motion, np.array(config.q_start), transform(tuple(config.tcp_offset))
        )
        self.inputs: dict[str, Value] = {name: zero_of(kind) for name, kind in INPUTS.items()}
        self._program: ControlProgram | None = None
        self._command_seen_cycle = 0
        self._stopped_cycle = 0
        self._registers: dict[str, Value] = {}
        self._texts: list[str] = []
        self._random = np.random.default_rng([seed, 30004])
        self._slider = 1.0

    @property
    def timestamp_s(self) -> float:
        """The controller's own clock."""
        elapsed_s = self.cycle * STEP_S * (1.0 + self.config.clock_error)
        return self.config.timestamp_start_s + elapsed_s

    def input_int(self, i: int) -> int:
        """Input integer register ``i``."""
        return int(self.inputs[f"input_int_register_{i}"])  # type: ignore[arg-type]

    def input_double(self, i: int) -> float:
        """Input double register ``i``."""
        return float(self.inputs[f"input_double_register_{i}"])  # type: ignore[arg-type]

    def set_output_int(self, i: int, value: int) -> None:
        """Write output integer register ``i``."""
        self._registers[f"output_int_register_{i}"] = value

    def set_output_double(self, i: int, value: float) -> None:
        """Write output double register ``i``."""
        self._registers[f"output_double_register_{i}"] = value

    def write_inputs(self, values: dict[str, Value]) -> None:
        """Take the inputs of one data frame; feeds the watchdog of the command register."""
        self.inputs.update(values)
        if "input_int_register_0" in values:
            self._command_seen_cycle = self.cycle + self.owed_cycles
        if "speed_slider_fraction" in values and self.inputs["speed_slider_mask"]:
            self._slider = float(np.clip(self.inputs["speed_slider_fraction"], 0.0, 1.0))

    def set_slider(self, fraction: float) -> None:
        """Somebody moves the speed slider at the pendant; raises ValueError outside [0, 1]."""
        if not 0.0 <= fraction <= 1.0:
            raise ValueError(f"the speed slider goes from 0 to 1, not to {fraction!r}")
        self._slider = fraction

    def take_texts(self) -> list[str]:
        """What the controller has to say since the last call."""
        texts, self._texts = self._texts, []
        return texts

    def start_program(self, text: str) -> None:
        """Run an uploaded script, replacing the one that runs.

        Only a script that reads the command register is emulated; any other ends at once.
        Nothing happens while the arm is not ready to move.
        """
        if self.safety_mode is not SafetyMode.NORMAL or self.robot_mode is not RobotMode.RUNNING:
            return
        self.stop_program()
        if "read_input_integer_reg" in text:
            self._program = ControlProgram(self, self.motion)
            self.runtime = RuntimeState.PLAYING

    def stop_program(self) -> None:
        """End the program, as the pendant's stop button or the watchdog does."""
        if self._program is not None or self.runtime is not RuntimeState.STOPPED:
            self.motion.stop_joint(self.config.motion.program_stop_rad_s2)
        self._program = None
        self.runtime = RuntimeState.STOPPED

    def pause(self) -> bool:
        """Pause a running program; whether there was one."""
        if self.runtime is not RuntimeState.PLAYING:
            return False
        self.motion.stop_joint(self.config.motion.program_stop_rad_s2)
        self.runtime = RuntimeState.PAUSED
        return True

    def play(self) -> bool:
        """Resume a paused program; whether there was one."""
        if self.runtime is not RuntimeState.PAUSED:
            return False
        self.runtime = RuntimeState.PLAYING
        return True

    def protective_stop(self, reason: str = "") -> None:
        """What a collision does, and asking for what the arm cannot do."""
        if self.safety_mode is SafetyMode.NORMAL:
            self._safety_stop(SafetyMode.PROTECTIVE_STOP)
            self._texts.append("protective stop" + (f": {reason}" if reason else ""))
            del self._texts[:-_MOST_TEXTS]

    def emergency_stop(self) -> None:
        """Somebody presses the red button; it stays pressed."""
        self._losing_power = True
        self._safety_stop(SafetyMode.ROBOT_EMERGENCY_STOP)

    def release_emergency_stop(self) -> None:
        """Somebody turns the red button; the arm stays without power."""
        if self.safety_mode is SafetyMode.ROBOT_EMERGENCY_STOP:
            self.safety_mode = SafetyMode.NORMAL

    def unlock_protective_stop(self) -> bool:
        """Whether the stop could be unlocked: not in its first seconds."""
        if (self.cycle - self._stopped_cycle) * STEP_S < self.config.unlock_after_s:
            return False
        if self.safety_mode is SafetyMode.PROTECTIVE_STOP:
            self.safety_mode = SafetyMode.NORMAL
        return True

    def step(self) -> None:
        """One cycle: watchdog, program, motion."""
        self.cycle += 1
        program = self._program
        ticks = self.cycle % self.config.cycles_per_tick == 0
        if ticks and program is not None and self.runtime is RuntimeState.PLAYING:
            silent = self.cycle - self._command_seen_cycle
            period_s = program.watchdog_s
            if period_s is not None and silent > watchdog_cycles(period_s):
                self.stop_program()
            else:
                program.step()
                if program.wants_protective_stop:
                    self.protective_stop()
                elif program.ended:
                    self.stop_program()
        self.motion.speed_scaling = self._slider
        self.motion.step()
        if self.motion.violation is not None:
            self.protective_stop(self.motion.violation)
        if self._losing_power and self.motion.at_rest:
            self._losing_power = False
            self.robot_mode = RobotMode.POWER_OFF

    def outputs(self) -> dict[str, Value]:
        """The present value of every output that is not constantly zero."""
        motion = self.motion
        qd = motion.qd + self._random.standard_normal(6) * self.config.speed_noise_rad_s
        (T, J), (T_target, J_target) = motion.actual(), motion.target()
        scaling = self._slider
        return {
            **self._registers,
            "timestamp": self.timestamp_s,
            "actual_q": _tuple(motion.q),
            "actual_qd": _tuple(qd),
            "target_q": _tuple(motion.q_target),
            "target_qd": _tuple(motion.qd_target),
            "actual_TCP_pose": pose_vector(T),
            "actual_TCP_speed": _tuple(J @ qd),
            "target_TCP_pose": pose_vector(T_target),
            "target_TCP_speed": _tuple(J_target @ motion.qd_target),
            "tcp_offset": pose_vector(motion.T_flange_tool),
            "robot_mode": int(self.robot_mode),
            "joint_mode": (_JOINT_RUNNING,) * 6,
            "safety_mode": int(self.safety_mode),
            "safety_status": int(self.safety_mode),
            "safety_status_bits": safety_status_bits(self.safety_mode),
            "robot_status_bits": robot_status_bits(self.robot_mode, self.runtime),
            "runtime_state": int(self.runtime),
            "speed_scaling": scaling,
            "target_speed_fraction": scaling,
        }

    def _safety_stop(self, mode: SafetyMode) -> None:
        self.safety_mode = mode
        self._stopped_cycle = self.cycle
        self._program = None
        self.runtime = RuntimeState.STOPPED
        self.motion.stop_joint(self.config.motion.protective_stop_rad_s2)


def _tuple(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> tuple[float, ...]:
    return tuple(values.tolist())
