"""Real devices by name on the command line; without one its tests are not run."""

import pytest
from hypothesis import HealthCheck, settings

# The same examples every time, and no limits that a busy machine would break.
settings.register_profile(
    "repeatable", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("repeatable")

DEVICES = {
    "--ur-host": "a Universal Robots arm that may move 2 cm about where it stands: clear its way",
    "--grbl-port": "a homed serial gantry that may move 2 cm about where it stands: clear its way",
    "--camera-source": "a camera: index, /dev/v4l/by-id/..., or stream URL",
}


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("real devices", "tests marked `hardware`, run with -m hardware")
    for option, what in DEVICES.items():
        group.addoption(option, metavar="NAME", default=None, help=what)
    parser.addoption(
        "--seeds", type=int, default=20, help="random moments per fault and per ending (slow tests)"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        marker = item.get_closest_marker("hardware")
        if marker is not None and config.getoption(marker.args[0]) is None:
            item.add_marker(pytest.mark.skip(reason=f"name a device: {marker.args[0]}"))


@pytest.fixture
def seeds(request: pytest.FixtureRequest) -> range:
    """The random moments at which slow tests make things go wrong."""
    return range(request.config.getoption("--seeds"))
