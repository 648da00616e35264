"""One loopback controller per test module, one open arm per test."""

from collections.abc import Iterator

import pytest

from drivers.clock import WallClock
from drivers.ur.arm import UrArm
from drivers.ur.recovery import recover_controller
from drivers.ur.settings import UrSettings
from sim_backend.loopback_ur.process import LoopbackProcess
from tests.drivers.ur.loopback import start_loopback


@pytest.fixture(scope="module")
def loopback() -> Iterator[LoopbackProcess]:
    with start_loopback(unlock_after_s=0.2) as process:
        yield process


@pytest.fixture
def settings(loopback: LoopbackProcess) -> UrSettings:
    # Patient, because other work may hold this process up; the sharp figures are a benchmark's.
    return UrSettings(host=loopback.host, watchdog_hz=5.0, max_state_age_s=0.2)


@pytest.fixture
def arm(settings: UrSettings, loopback: LoopbackProcess) -> Iterator[UrArm]:
    """An open arm; what the test left broken is repaired for the next one."""
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    device = UrArm(settings, WallClock())
    yield device
    device.close()
    loopback.control.clear()
    recover_controller(loopback.host, WallClock(), lambda explanation: True)
