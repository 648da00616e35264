"""What an emulated rig refuses before anything is started."""

from pathlib import Path

import pytest

from drivers.clock import WallClock
from drivers.errors import ConfigError
from sim_backend.config import SimConfig
from sim_backend.loopback_rig.rig import LoopbackRig

pytestmark = pytest.mark.realtime


def served(tmp_path: Path, **changes: object) -> LoopbackRig:
    given: dict[str, object] = {
        "arm": "ur",
        "config": SimConfig(),
        "target": "sphere",
        "clock": WallClock(),
        "host": "127.0.0.1",
        "link": tmp_path / "gantry",
        "camera_port": None,
        "lifetime_s": 10.0,
    }
    return LoopbackRig(**(given | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"host": "192.168.0.1"}, "loopback addresses only"),
        ({"host": "localhost"}, "loopback addresses only"),
        ({"ur_version": "cb3"}, "no controller version: write it as"),
        ({"ur_version": "3.15.8.1.2"}, "no controller version"),
        ({"ur_version": "3.-1"}, "no controller version"),
    ],
)
def test_wrong_addresses_and_versions_are_named(tmp_path, changes, message):
    with pytest.raises(ConfigError, match=message):
        served(tmp_path, **changes)
