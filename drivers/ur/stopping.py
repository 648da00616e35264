"""Stopping an arm whoever set it moving, and seeing to it that it stands still."""

from collections import deque

import numpy as np

from drivers.clock import Clock
from drivers.errors import ConnectError, OperateError
from drivers.ur.faults import PROGRAM_STOPPED, RUNTIME_STATES
from drivers.ur.receiver import Sampler
from drivers.ur.recovery import stop_controller
from drivers.ur.ring import Sample
from drivers.ur.rtde_codec import RtdeError
from drivers.ur.rtde_stream import RtdeStream

_CONNECT_S = 5.0
_REST_TIMEOUT_S = 3.0
_LOOK_S = 0.2  # over which no joint may move
_STILL_RAD = 5e-4


def stop_arm(host: str, clock: Clock) -> str:
    """Stop the program on the controller at ``host`` and see the arm at rest; says what was done.

    Raises ConnectError where the controller cannot be told, OperateError, naming the emergency
    stop, where its own states do not show within 3 s that no program runs and no joint moves:
    it refused, or somebody moves the arm by hand or pendant.
    """
    emergency = "should the arm move, use the emergency stop"
    try:
        reply = stop_controller(host)
    except ConnectError as error:
        raise ConnectError(f"{error}. Nothing was stopped: {emergency}") from error
    told = f"the arm at {host} was told to stop and answered {reply!r}"
    try:
        problem = _watch(host, clock)
    except (ConnectError, RtdeError, OSError) as error:
        unseen = f"{told}, but whether it stands still cannot be seen ({error}): {emergency}"
        raise OperateError(unseen) from error
    if problem is not None:
        raise OperateError(f"{told}, but {problem}: use the emergency stop")
    return f"the arm at {host} stands still and no program runs: it was told to stop: {reply}"


def why_not_at_rest(samples: list[Sample]) -> str | None:
    """What the samples of the last ``_LOOK_S`` show that is not rest; None at rest."""
    if not samples:
        return "it reports no state"
    runtime = samples[-1].runtime_state
    if runtime != PROGRAM_STOPPED:
        return f"its program is {RUNTIME_STATES.get(runtime, str(runtime))}"
    if float(np.ptp([sample.q_rad for sample in samples], axis=0).max()) > _STILL_RAD:
        return "its joints move without a program, as by hand or pendant"
    return None


def _watch(host: str, clock: Clock) -> str | None:
    """Wait for rest; what there is instead when the time is over."""
    stream = RtdeStream(host, clock, _CONNECT_S)
    try:
        sampler, samples = Sampler(), deque[Sample]()
        problem: str | None = "it reports no state"
        deadline_s = clock.now_s() + _REST_TIMEOUT_S
        while clock.now_s() < deadline_s:
            packets, arrival_s = stream.read(_LOOK_S)
            samples.extend(sampler.samples(packets, arrival_s))
            while (
                len(samples) > 1 and samples[-1].controller_s - samples[1].controller_s >= _LOOK_S
            ):
                samples.popleft()
            problem = why_not_at_rest(list(samples))
            if problem is None and samples[-1].controller_s - samples[0].controller_s >= _LOOK_S:
                return None
        return problem or "it reports too few states"
    finally:
        stream.close()
