"""A calibration holds for one tool centre point: with another on the arm nothing moves."""

from pathlib import Path

import numpy as np
import pytest

import rig.build
from drivers.clock import Clock
from drivers.errors import ConfigError
from drivers.interfaces import Arm
from rig.build import build_rig
from rig.calibrated import calibrated
from rig.calibration.result import load_calibration, save_calibration
from rig.calibration.views import BoardView, PosedView
from rig.calibration_place import calibration_path
from rig.calibration_run.stills import Still
from rig.calibration_run.store import Store
from rig.config_load import load_config
from rig.tcp_offset import check_tcp, tcp_fingerprint, tcp_of
from sim_backend.arm import SimulatedArm
from sim_backend.clock import SimulatedClock
from tests.rig.calibration_run.small_rig import calibrate
from tests.rig.fakes import KinematicArm
from tests.rig.made_calibration import calibration_of

STILL = Still(
    PosedView(BoardView(np.arange(1), np.zeros((1, 3)), np.zeros((1, 2))), np.eye(4)),
    np.zeros((48, 64), np.uint8),
    0.0,
    0.0,
)
TCP = (0.0, 0.0, 0.12, 0.0, -0.3, 0.001)


def arm_with(tcp: tuple[float, ...] | None) -> KinematicArm:
    return KinematicArm(SimulatedClock(), tcp=None if tcp is None else np.array(tcp))


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("moved", [1e-3, -1e-3, 5e-5])
@pytest.mark.parametrize("axis", range(6))
def test_a_tcp_that_was_changed_on_the_arm_is_refused(axis: int, moved: float) -> None:
    other = tuple(x + moved * (k == axis) for k, x in enumerate(TCP))
    with pytest.raises(ConfigError, match=r"0\.12000.*pendant.*rig calibrate"):
        check_tcp(arm_with(other), TCP)


def test_the_same_tcp_goes_through_the_file_and_is_accepted() -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        arm = arm_with(tuple(rng.uniform(-1, 1, 6)))
        check_tcp(arm, tcp_of(tcp_fingerprint(arm)))


def test_an_arm_that_keeps_no_tcp_adds_nothing_and_is_accepted() -> None:
    assert tcp_fingerprint(arm_with(None)) == {}
    check_tcp(arm_with(None), TCP)
    check_tcp(arm_with(TCP), None)


def with_file(tcp: str) -> None:
    config = load_config("sphere")
    file = calibration_of(config)
    assert file.hand_eye is not None
    hand_eye = file.hand_eye.model_copy(
        update={"depends_on": file.hand_eye.depends_on | {"tcp": tcp}}
    )
    save_calibration(file.model_copy(update={"hand_eye": hand_eye}), calibration_path(config))


def test_a_run_with_another_tcp_closes_the_arm_again(monkeypatch: pytest.MonkeyPatch) -> None:
    with_file("0 0 0.12 0 0 0")
    config = calibrated(load_config("sphere")).config
    arms: list[KinematicArm] = []

    def open_arm(settings: object, clock: Clock) -> Arm:
        arms.append(arm_with((0.0, 0.0, 0.13, 0.0, 0.0, 0.0)))
        return arms[-1]

    real = load_config(
        "sphere",
        None,
        [
            "camera={driver: opencv, source: 'http://127.0.0.1:1/stream.mjpg'}",
            "arm={driver: ur, host: 127.0.0.1}",
            "run.vision=thread",
        ],
    ).model_copy(update={"calibration": config.calibration})
    closed: list[str] = []

    class Camera:
        def read(self, timeout_s: float) -> None:
            raise AssertionError("nothing is looked at")

        def close(self) -> None:
            closed.append("camera")

    monkeypatch.setattr(rig.build, "open_arm", open_arm)
    monkeypatch.setattr(rig.build, "open_camera", lambda settings, clock: Camera())
    with pytest.raises(ConfigError, match="TCP"):
        build_rig(real, "sphere", realtime=True)
    assert arms[0].closed and closed == ["camera"]
    assert not arms[0].commands


def test_data_of_another_tcp_are_not_gone_on_with(here: Path) -> None:
    folder = here / "data"
    first = Store(folder, {"camera": "c"}, resume=False)
    first.also_under(tcp_fingerprint(arm_with(TCP)))
    first.add_still(STILL)
    again = Store(folder, {"camera": "c"}, resume=True)
    again.also_under(tcp_fingerprint(arm_with(TCP)))
    assert len(again.stills) == 1
    other = Store(folder, {"camera": "c"}, resume=True)
    with pytest.raises(ConfigError, match="cannot resume: tcp changed"):
        other.also_under(tcp_fingerprint(arm_with((0.0,) * 6)))


@pytest.mark.slow
def test_calibrating_notes_the_tcp_and_does_not_mix_data_of_two(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SimulatedArm, "tcp_offset", lambda self: np.array(TCP))
    done = calibrate("hand-eye")
    assert done.exit_code == 0, done.stderr
    found = load_calibration(here / "calibration" / "sim.yaml").hand_eye
    assert found is not None and tcp_of(found.depends_on) == TCP
    monkeypatch.setattr(SimulatedArm, "tcp_offset", lambda self: np.zeros(6))
    resumed = calibrate("latency")
    assert resumed.exit_code == 2 and "cannot resume: tcp changed" in resumed.stderr
