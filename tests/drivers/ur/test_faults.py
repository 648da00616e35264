"""The controller's bits in words: each state has one error, the gravest wins."""

import pytest

from drivers.errors import OperateError
from drivers.ur.faults import (
    ArmStoppedError,
    EmergencyStopError,
    ProgramStoppedError,
    ProtectiveStopError,
    fault_of,
)


@pytest.mark.parametrize("bits", [1, 1 | 2, 2])
def test_normal_and_reduced_are_no_fault(bits):
    assert fault_of("arm", bits, 7, 2) is None


@pytest.mark.parametrize(
    ("bits", "mode", "runtime", "kind", "word"),
    [
        (1 << 2 | 1 << 10, 7, 1, ProtectiveStopError, "protective stop"),
        (1 << 5, 7, 1, EmergencyStopError, "release the button"),
        (1 << 6 | 1 << 7, 3, 1, EmergencyStopError, "emergency stop"),
        (1 << 7 | 1 << 2, 7, 1, EmergencyStopError, "emergency stop"),
        (1 << 8, 7, 1, ArmStoppedError, "violation"),
        (1 << 9, 7, 1, ArmStoppedError, "fault"),
        (1 << 4, 7, 1, ArmStoppedError, "safeguard"),
        (1 << 3, 7, 1, ArmStoppedError, "recovery mode"),
        (1, 3, 1, ArmStoppedError, "power off"),
        (1, 5, 1, ArmStoppedError, "idle"),
        (1, 7, 1, ProgramStoppedError, "was stopped"),
        (1, 7, 4, ProgramStoppedError, "paused"),
    ],
)
def test_each_state_has_its_error_and_says_where_and_what_next(bits, mode, runtime, kind, word):
    error = fault_of("10.0.0.7", bits, mode, runtime)
    assert type(error) is kind
    assert isinstance(error, OperateError)
    assert "10.0.0.7" in str(error)
    assert word in str(error)
    assert "recover" in str(error) or "jog it back" in str(error)
