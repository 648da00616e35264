"""The vendor's interface at its edge: whatever goes wrong there is one of our errors."""

from types import SimpleNamespace

import numpy as np
import pytest

from drivers.errors import ConnectError, OperateError
from drivers.ur import motor
from drivers.ur.commander import Speed
from drivers.ur.motor import Motor


class FakeControl:
    """What ``RTDEControlInterface`` would be."""

    def __init__(self, host, running=True, raises=None):
        if raises is not None:
            raise raises
        self.calls = []
        self.connected = True
        self.running = running

    def isProgramRunning(self):
        return self.running

    def isConnected(self):
        return self.connected

    def __getattr__(self, name):
        def call(*arguments):
            self.calls.append((name, *arguments))
            return True

        return call


@pytest.fixture
def vendor(monkeypatch):
    """Installs a vendor module; returns a function that says how its interface behaves."""

    def install(**behaviour):
        made = []

        def interface(host):
            made.append(FakeControl(host, **behaviour))
            return made[-1]

        module = SimpleNamespace(RTDEControlInterface=interface)
        monkeypatch.setattr(motor, "import_module", lambda name: module)
        return made

    return install


def test_a_missing_package_is_one_command_to_type(monkeypatch):
    def missing(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(motor, "import_module", missing)
    with pytest.raises(ConnectError, match=r"pip install 'ur-rtde"):
        Motor("arm", 0.002, 10.0)


def test_the_watchdog_is_armed_before_anything_moves(vendor):
    made = vendor()
    arm = Motor("arm", 0.002, 12.5)
    arm.send(Speed(np.arange(6.0), 3.0))
    assert made[0].calls == [
        ("setWatchdog", 12.5),
        ("speedL", [0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 3.0, 0.002),
    ]


def test_nothing_to_move_still_feeds_the_watchdog(vendor):
    made = vendor()
    Motor("arm", 0.002, 10.0).send(None)
    assert made[0].calls[-1] == ("kickWatchdog",)


@pytest.mark.parametrize("error", [RuntimeError("refused"), ValueError("x"), OSError("gone")])
def test_a_vendor_error_at_connect_names_the_arm(vendor, error):
    vendor(raises=error)
    with pytest.raises(ConnectError, match=r"arm at 10\.0\.0\.9"):
        Motor("10.0.0.9", 0.002, 10.0)


def test_a_program_that_does_not_run_is_a_connect_error(vendor):
    vendor(running=False)
    with pytest.raises(ConnectError, match="remote control"):
        Motor("arm", 0.002, 10.0)


def test_a_gone_connection_is_not_taken_for_a_success(vendor):
    made = vendor()
    arm = Motor("arm", 0.002, 10.0)
    made[0].connected = False
    with pytest.raises(OperateError, match="gone"):
        arm.send(Speed(np.zeros(6), 3.0))
    arm.end()
    assert "stopScript" not in [call[0] for call in made[0].calls]
