"""How fast and how evenly a controller on the network answers."""

import socket
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import ConnectError, OperateError, RigError
from drivers.ur.dashboard import Dashboard
from drivers.ur.rtde_codec import RtdeError
from drivers.ur.rtde_stream import RTDE_PORT, RtdeStream
from drivers.ur.settings import UrSettings
from rig.doctor.finding import Finding, Status
from rig.doctor.subject import Subject

FloatArray = NDArray[np.float64]

_TIMEOUT_S = 3.0
_CONNECTIONS = 10
_QUESTIONS = 50
_LISTEN_S = 3.0
_LISTEN_QUICK_S = 1.0
_LONG_CONNECT_S = 0.002
_MISSING = 0.02  # share of the states that may not come
_CABLE = (
    "give the arm a cable of its own to this machine, no Wi-Fi, no shared switch; a busy machine "
    "(row loop idle) does the same"
)


@dataclass(frozen=True, slots=True)
class NetworkFacts:
    """Samples of a network connection to a UR controller."""

    connect_s: FloatArray  # (n,) of a TCP connection: one trip there and back
    answer_s: FloatArray  # (m,) of the dashboard, program included; empty where there is none
    gaps_s: FloatArray  # (k,) between arrivals of states
    states: int
    lasted_s: float
    nominal_hz: float


def arm_link(subject: Subject, clock: Clock) -> Finding:
    """Measure the way to the arm's controller and back."""
    settings = subject.config.arm
    try:
        if isinstance(settings, UrSettings):
            look_s = _LISTEN_QUICK_S if subject.quick else _LISTEN_S
            facts = measure_network(settings.host, clock, look_s)
            return judge_network(facts, settings.max_state_age_s)
    except RigError as error:
        return Finding("arm_link", Status.FAIL, str(error), "see the arm's row")
    return Finding("arm_link", Status.OK, "simulated")


def measure_network(host: str, clock: Clock, look_s: float) -> NetworkFacts:
    """Connect, ask and listen; nothing is uploaded. Raises RigError."""
    stream = RtdeStream(host, clock, _TIMEOUT_S)
    try:
        arrivals_s, states = _listen(stream, clock, look_s)
    except (OSError, RtdeError) as error:
        raise OperateError(f"the arm at {host} stopped reporting: {error}") from error
    finally:
        stream.close()
    return NetworkFacts(
        connect_s=_connections(host, clock),
        answer_s=_answers(host, clock),
        gaps_s=np.diff(arrivals_s),
        states=states,
        lasted_s=float(arrivals_s[-1] - arrivals_s[0]) if len(arrivals_s) > 1 else 0.0,
        nominal_hz=stream.rate_hz,
    )


def judge_network(facts: NetworkFacts, max_state_age_s: float) -> Finding:
    """States must come at the controller's rate and never as late as counts as a stall."""
    if facts.lasted_s <= 0.0 or len(facts.gaps_s) == 0:
        text = "the controller accepts connections but sends no states"
        return Finding("arm_link", Status.FAIL, text, "restart the controller")
    rate_hz = (facts.states - 1) / facts.lasted_s
    gap_p99_s, gap_max_s = _p99(facts.gaps_s), float(facts.gaps_s.max())
    connect_p99_s = _p99(facts.connect_s)
    values = {
        "connect_median_s": float(np.median(facts.connect_s)),
        "connect_p99_s": connect_p99_s,
        "dashboard_median_s": float(np.median(facts.answer_s)) if len(facts.answer_s) else None,
        "dashboard_p99_s": _p99(facts.answer_s) if len(facts.answer_s) else None,
        "state_rate_hz": rate_hz,
        "state_gap_p99_s": gap_p99_s,
        "state_gap_max_s": gap_max_s,
        "state_jitter_s": float(np.std(facts.gaps_s)),
    }
    text = f"TCP {_trip(facts.connect_s)}, "
    text += f"dashboard {_trip(facts.answer_s)}, " if len(facts.answer_s) else "no dashboard, "
    text += (
        f"{rate_hz:.0f} of {facts.nominal_hz:.0f} states/s, gaps p99 {gap_p99_s * 1e3:.1f} ms, "
        f"longest {gap_max_s * 1e3:.1f} ms"
    )
    if gap_max_s > max_state_age_s:
        advice = f"a run would stop: states may be {max_state_age_s * 1e3:.0f} ms late. {_CABLE}"
        return Finding("arm_link", Status.FAIL, text, advice, values)
    missing = rate_hz < (1.0 - _MISSING) * facts.nominal_hz
    if missing or gap_max_s > 0.5 * max_state_age_s or connect_p99_s > _LONG_CONNECT_S:
        return Finding("arm_link", Status.WARN, text, _CABLE, values)
    return Finding("arm_link", Status.OK, text, "", values)


def _listen(stream: RtdeStream, clock: Clock, look_s: float) -> tuple[FloatArray, int]:
    """When packets arrived, and how many states came in them."""
    arrivals_s: list[float] = []
    states = 0
    end_s = clock.now_s() + look_s
    while (left_s := end_s - clock.now_s()) > 0.0:
        packets, arrival_s = stream.read(left_s)
        if packets:
            arrivals_s.append(arrival_s)
            states += len(packets)
    return np.array(arrivals_s), states


def _connections(host: str, clock: Clock) -> FloatArray:
    """How long a TCP connection takes: the kernels answer, no program is waited for."""
    out = []
    for _ in range(_CONNECTIONS):
        start_s = clock.now_s()
        try:
            with socket.create_connection((host, RTDE_PORT), _TIMEOUT_S):
                out.append(clock.now_s() - start_s)
        except OSError as error:
            raise ConnectError(
                f"{host}:{RTDE_PORT} takes no further connection: {error}"
            ) from error
    return np.array(out)


def _answers(host: str, clock: Clock) -> FloatArray:
    """How long the dashboard takes to answer; empty where there is none."""
    out = []
    try:
        with Dashboard(host, _TIMEOUT_S) as dashboard:
            for _ in range(_QUESTIONS):
                start_s = clock.now_s()
                dashboard.ask("robotmode")
                out.append(clock.now_s() - start_s)
    except RigError:
        return np.array(out)
    return np.array(out)


def _p99(samples: FloatArray) -> float:
    return float(np.percentile(samples, 99))


def _trip(samples_s: FloatArray) -> str:
    return f"{np.median(samples_s) * 1e3:.2g} ms (p99 {_p99(samples_s) * 1e3:.2g})"
