"""A look at the arm without taking control of it: nothing is uploaded, nothing can move."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import ConnectError, OperateError
from drivers.ur.dashboard import Dashboard
from drivers.ur.faults import PROGRAM_PLAYING, ROBOT_MODES, RUNTIME_STATES, SAFETY_MODES, fault_of
from drivers.ur.kinematics import identify
from drivers.ur.receiver import Sampler
from drivers.ur.ring import Sample
from drivers.ur.rtde_codec import RtdeError
from drivers.ur.rtde_stream import RtdeStream

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class UrStatus:
    """What the controller says about itself."""

    version: str
    serial_number: str
    model: str
    safety: str  # "normal", "protective stop", …
    robot_mode: str  # "running", "power off", …
    program: str  # "stopped", "playing", …
    remote_control: bool | None  # None where the controller has no such mode (CB3)
    speed_scaling: float
    T_base_tool: FloatArray  # (4, 4)
    twist_base: FloatArray  # (6,)
    q_rad: FloatArray  # (6,)
    tcp_offset: FloatArray  # (6,) m and rad, NaN where the controller does not say
    rate_hz: float  # of the samples that came
    longest_gap_s: float  # between two arrivals
    kinematics: str | None  # the model whose tool would be where it is measured; None: no known one
    problem: str | None  # what keeps the arm from moving; a stopped program does not


def read_status(host: str, clock: Clock, look_s: float = 0.5, timeout_s: float = 5.0) -> UrStatus:
    """Listen for ``look_s`` and ask the dashboard; raises ConnectError or OperateError."""
    stream = RtdeStream(host, clock, timeout_s)
    try:
        samples = _listen(stream, clock, look_s)
    except (OSError, RtdeError) as error:
        raise OperateError(f"the arm at {host} stopped reporting: {error}") from error
    finally:
        stream.close()
    if len(samples) < 2:
        raise OperateError(f"the arm at {host} accepts connections but reports no state")
    last = samples[-1]
    arrivals = np.array([sample.arrival_s for sample in samples])
    span_s = last.controller_s - samples[0].controller_s
    serial, model, remote = _dashboard_facts(host, timeout_s)
    # A program that is not running is no problem: connecting starts one.
    fault = fault_of(host, last.safety_status_bits, last.robot_mode, PROGRAM_PLAYING)
    return UrStatus(
        version=".".join(str(part) for part in stream.version),
        serial_number=serial,
        model=model,
        safety=SAFETY_MODES.get(last.safety_mode, str(last.safety_mode)),
        robot_mode=ROBOT_MODES.get(last.robot_mode, str(last.robot_mode)),
        program=RUNTIME_STATES.get(last.runtime_state, str(last.runtime_state)),
        remote_control=remote,
        speed_scaling=last.speed_scaling,
        T_base_tool=last.T_base_tool,
        twist_base=last.twist_base,
        q_rad=last.q_rad,
        tcp_offset=last.tcp_offset,
        rate_hz=(len(samples) - 1) / span_s if span_s > 0.0 else 0.0,
        longest_gap_s=float(np.diff(arrivals).max()),
        kinematics=_model(last),
        problem=None if fault is None else str(fault),
    )


def _listen(stream: RtdeStream, clock: Clock, look_s: float) -> list[Sample]:
    sampler = Sampler()
    samples: list[Sample] = []
    end_s = clock.now_s() + look_s
    while (remaining_s := end_s - clock.now_s()) > 0.0:
        packets, arrival_s = stream.read(remaining_s)
        samples += sampler.samples(packets, arrival_s)
    return samples


def _model(sample: Sample) -> str | None:
    tcp_offset = sample.tcp_offset if np.all(np.isfinite(sample.tcp_offset)) else np.zeros(6)
    known = identify(sample.q_rad, sample.T_base_tool, tcp_offset)
    return None if known is None else known.model.name


def _dashboard_facts(host: str, timeout_s: float) -> tuple[str, str, bool | None]:
    """Serial number, model and remote-control mode; blank or None where nobody says."""
    try:
        with Dashboard(host, timeout_s) as dashboard:
            serial = dashboard.ask("get serial number")
            model = dashboard.ask("get robot model")
            remote = dashboard.ask("is in remote control")
    except ConnectError:
        return "", "", None
    return serial, model, {"true": True, "false": False}.get(remote.lower())
