"""The program's own processes run the program's own code, wherever they are started."""

from pathlib import Path

import pytest

from drivers.clock import WallClock
from drivers.errors import ConnectError
from drivers.ur.link import ChildLink
from drivers.ur.settings import UrSettings
from sim_backend.loopback_grbl.process import LoopbackGantryProcess
from sim_backend.loopback_ur.process import LoopbackProcess
from tests.drivers.ur.loopback import free_host

pytestmark = pytest.mark.realtime

NAMES = ("select.py", "socket.py", "numpy.py", "drivers/__init__.py", "sim_backend/__init__.py")


@pytest.fixture
def untidy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current directory, full of files with names of modules; they tell when they ran."""
    for name in NAMES:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"open({str(tmp_path / 'ran')!r}, 'a').write({name!r})\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "ran"


def test_the_process_that_talks_to_an_arm(untidy: Path) -> None:
    with pytest.raises(ConnectError, match="no arm controller answers"):
        ChildLink(UrSettings(host=free_host()), WallClock())
    assert not untidy.exists()


def test_an_emulated_arm(untidy: Path) -> None:
    LoopbackProcess(free_host()).close()
    assert not untidy.exists()


def test_an_emulated_gantry(untidy: Path) -> None:
    LoopbackGantryProcess(untidy.with_name("gantry")).close()
    assert not untidy.exists()
