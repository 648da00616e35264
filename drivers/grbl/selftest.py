"""The optional self-test move: how long the arm takes to turn round, measured."""

from itertools import pairwise

import numpy as np

from drivers.errors import OperateError
from drivers.grbl.delay import MeasuredDelay
from drivers.grbl.session import Session
from drivers.interfaces import ArmState

_LEG_S = 0.5
_HOLD_S = 1.0
_WATCH_S = 0.6
_SETTLE_S = 0.3


def measure_delay(session: Session, length_mm: float) -> MeasuredDelay:
    """Move ``length_mm`` along the tool's x and back; the delay from command to motion.

    The delay is that of a running stream: from commanding the way back to the measured
    velocity's change of sign, less the time that braking to zero takes. Raises OperateError
    where the arm does not do it.
    """
    speed_m_s = 1e-3 * length_mm / _LEG_S
    there = np.array([speed_m_s, 0.0, 0.0, 0.0, 0.0, 0.0])
    core, clock = session.core, session.clock
    session.run_for(0.2)
    core.command(there, _HOLD_S, clock.now_s())
    session.run_for(_LEG_S)
    core.take_states()
    turned_s = clock.now_s()
    core.command(-there, _HOLD_S, turned_s)
    session.run_for(_LEG_S)
    states = core.take_states()
    # At rest by running out, not by a cancel: the way back is then as long as the way there.
    core.command(0.0 * there, _WATCH_S, clock.now_s())
    session.run_for(_WATCH_S)
    core.stop()
    session.run_for(_SETTLE_S)
    core.take_states()
    if core.failure is not None:
        raise core.failure
    crossing_s = _crossing(states, turned_s)
    if crossing_s is None:
        raise OperateError("the gantry did not make its self-test move: look at it, then try again")
    braking_s = speed_m_s * 1e3 / float(np.min(session.controller.acceleration[:3]))
    # Commands are looked at once per block.
    std_s = float(np.hypot(session.timing.stamp_std_s, session.timing.segment_s / np.sqrt(12.0)))
    return MeasuredDelay(crossing_s - turned_s - braking_s, std_s)


def _crossing(states: list[ArmState], after_s: float) -> float | None:
    """When the velocity along x changes its sign from plus to minus."""
    for before, after in pairwise(states):
        v0, v1 = before.twist_tool[0], after.twist_tool[0]
        if after.t_s > after_s and v0 > 0.0 >= v1:
            return float(before.t_s + (after.t_s - before.t_s) * v0 / (v0 - v1))
    return None
