"""What every arm that can fail owes its user when it does: a typed error, rest, no old motion."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from drivers.errors import OperateError
from tests.contract.arms import Backend, loopback_gantry, loopback_ur
from tests.contract.driving import HOLD_S, Driving, opened

pytestmark = pytest.mark.slow

REST = np.zeros(6)
NOTICED_S = 1.5  # a silent line takes the longest
UR = ("protective_stop", "emergency_stop", "program_stop", "drop", "stall")
GANTRY = ("alarm", "door", "emergency_stop", "reset", "stall", "drop")


@pytest.fixture
def backend(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Backend]:
    make: Callable[[ExitStack, Path], Backend] = request.param
    with ExitStack() as stack:
        yield make(stack, tmp_path)


def broken(driving: Driving, fault: str) -> tuple[float, OperateError]:
    """Break the device under a moving arm; when that was, and what its user heard of it."""
    backend = driving.backend
    assert backend.device is not None
    driving.follow(backend.twist, backend.settle_s)
    begun_s = backend.clock.now_s()
    backend.device.fault(fault)
    error = driving.error_of(backend.twist, NOTICED_S)
    assert isinstance(error, OperateError)
    return begun_s, error


@pytest.mark.parametrize(
    ("backend", "fault"),
    [(loopback_ur, fault) for fault in UR] + [(loopback_gantry, fault) for fault in GANTRY],
    indirect=["backend"],
    ids=lambda value: value if isinstance(value, str) else value.__name__,
)
def test_a_fault_is_typed_stays_ends_in_rest_and_no_old_motion_comes_back(
    backend: Backend, fault: str
) -> None:
    clock = backend.clock
    assert backend.device is not None
    with opened(backend) as driving:
        begun_s, error = broken(driving, fault)
        for use in (
            driving.arm.read_states,
            lambda: driving.arm.command_twist(backend.twist, HOLD_S),
        ):
            with pytest.raises(type(error)):
                use()
        driving.arm.stop()  # never raises: there is nothing left to stop
        clock.sleep_until(begun_s + 0.8)
        assert driving.last_motion_s(begun_s) < begun_s + 0.2 + backend.stop_s
        # An old state was never handed out as new.
        assert np.all(np.diff([state.t_s for state in driving.states]) > 0.0)

        backend.device.clear()
        driving.recover()
        recovered_s = clock.now_s()
        fresh = driving.look(0.3)
        driving.follow(REST, 0.2)
        assert fresh[0].t_s > recovered_s - backend.max_age_s
        assert driving.last_motion_s(recovered_s) == recovered_s
        driving.follow(backend.twist, backend.settle_s)
        assert driving.last_motion_s(recovered_s) > recovered_s + 0.5

        # Closing it in the middle of a failure is quiet too.
        broken(driving, fault)
        driving.arm.close()
        driving.arm.close()
