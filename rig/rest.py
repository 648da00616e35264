"""Whether an arm that was told to stop has come to rest, by its own measurement."""

import numpy as np

from drivers.clock import Clock
from drivers.errors import RigError
from drivers.interfaces import Arm, ArmState
from rig.fusion import Fusion

_AT_REST_M_S = 2e-3
_AT_REST_RAD_S = 1e-2
_TIMEOUT_S = 3.0


def wait_for_rest(clock: Clock, arm: Arm, fusion: Fusion, period_s: float) -> bool:
    """Whether the arm is measured at rest within 3 s; its states go to ``fusion`` meanwhile."""
    deadline_s = clock.now_s() + _TIMEOUT_S
    while clock.now_s() < deadline_s:
        try:
            fusion.add_states(arm.read_states())
        except RigError:
            return False
        if fusion.state is not None and _at_rest(fusion.state):
            return True
        clock.sleep_until(clock.now_s() + period_s)
    return False


def _at_rest(state: ArmState) -> bool:
    return bool(
        np.linalg.norm(state.twist_tool[:3]) < _AT_REST_M_S
        and np.linalg.norm(state.twist_tool[3:]) < _AT_REST_RAD_S
    )
