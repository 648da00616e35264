"""What a calibration of a real rig begins with, and what it cannot begin without."""

from collections.abc import Iterator

import numpy as np
import pytest

from drivers.clock import Clock
from drivers.errors import ConfigError, DeviceTimeoutError
from drivers.interfaces import Frame
from rig.calibration_run import bench
from rig.calibration_run.bench import Bench, open_bench
from rig.commands.calibrate_request import with_earlier
from rig.config import RigConfig
from rig.start_values import start_doubt, with_nominal
from sim_backend.clock import SimulatedClock
from tests.rig.fakes import KinematicArm
from tests.rig.made_calibration import calibration_of

DEVICES = {
    "camera": {"driver": "opencv", "source": "/dev/video7"},
    "arm": {"driver": "ur", "host": "192.0.2.1"},
}
PLACE = {"tool_camera_xyz_m": (0.0, 0.0, 0.05), "tool_camera_rotvec_rad": (0.0, 0.0, 0.1)}
LENS = {"fx_px": 700.0, "fy_px": 701.0, "cx_px": 310.0, "cy_px": 250.0}


def real(**calibration: object) -> RigConfig:
    return RigConfig.model_validate({**DEVICES, "calibration": calibration})


class Devices:
    """A camera of 320x200 px and an arm; what was opened and closed."""

    def __init__(self) -> None:
        self.events: list[str] = []
        self.arm = KinematicArm(SimulatedClock(), tcp=np.array([0, 0, 0.1, 0, 0, 0]))
        self.pictures = True

    def read(self, timeout_s: float) -> Frame | None:
        picture = np.zeros((200, 320), np.uint8)
        return Frame(picture, 0.0, 0.0, 0, "host") if self.pictures else None

    def close(self) -> None:
        self.events.append("camera closed")

    def open_camera(self, settings: object, clock: Clock) -> "Devices":
        self.events.append("camera opened")
        return self

    def open_arm(self, settings: object, clock: Clock) -> KinematicArm:
        self.events.append("arm opened")
        return self.arm


@pytest.fixture
def devices(monkeypatch: pytest.MonkeyPatch) -> Iterator[Devices]:
    made = Devices()
    monkeypatch.setattr(bench, "open_camera", made.open_camera)
    monkeypatch.setattr(bench, "open_arm", made.open_arm)
    monkeypatch.setattr(bench, "open_listener", made.open_arm)
    yield made


def opened(config: RigConfig, by_hand: bool = False) -> Bench:
    with open_bench(with_nominal(config), realtime=True, by_hand=by_hand) as found:
        return found


def test_without_intrinsics_a_lens_is_assumed_for_the_size_that_the_camera_has(
    devices: Devices,
) -> None:
    found = opened(real(nominal=PLACE))
    lens = found.intrinsics
    assert lens.fx_px == lens.fy_px == pytest.approx(160.0 / np.tan(np.radians(30)), rel=1e-3)
    assert (lens.cx_px, lens.cy_px) == (159.5, 99.5)
    assert "60°" in found.assumed
    assert found.conditions() == {
        "tcp": "0.00000 0.00000 0.10000 0.00000 0.00000 0.00000",
        "image size": "320x200",
    }


def test_given_ones_are_taken_as_they_are(devices: Devices) -> None:
    found = opened(real(nominal={**PLACE, "intrinsics": LENS}))
    assert found.intrinsics.fx_px == 700.0 and found.assumed == ""
    assert found.T_tool_camera[2, 3] == 0.05


def test_without_a_place_on_the_tool_nothing_is_opened_and_the_words_can_be_copied(
    devices: Devices,
) -> None:
    with pytest.raises(ConfigError, match=r"(?s)nominal:\n +tool_camera_xyz_m: \[.*--manual"):
        opened(real())
    assert devices.events == []


def test_by_hand_no_place_is_needed(devices: Devices) -> None:
    assert np.array_equal(opened(real(), by_hand=True).T_tool_camera, np.eye(4))


def test_a_camera_without_pictures_is_told_before_the_arm_is_opened(devices: Devices) -> None:
    devices.pictures = False
    with pytest.raises(DeviceTimeoutError, match="check the camera"):
        opened(real(nominal=PLACE))
    assert devices.events == ["camera opened", "camera closed"]


def test_a_guessed_lens_is_doubted_more() -> None:
    plan = real().calibration.plan
    assert start_doubt(plan.doubt, guessed=False) == plan.doubt
    assert start_doubt(plan.doubt, guessed=True).focal > 0.2


def test_later_steps_begin_with_what_the_earlier_ones_found() -> None:
    config = real(nominal={**PLACE, "intrinsics": LENS})
    before = calibration_of(config)
    start = with_nominal(with_earlier(config, "verify", before)).calibration
    assert start.intrinsics is not None and start.intrinsics.fx_px == 790.0
    assert start.intrinsics.image_size_px == (640, 480)
    assert start.tool_camera_xyz_m == (0.01, 0.02, 0.03)
    anew = with_nominal(with_earlier(config, "hand-eye", before)).calibration
    assert anew.intrinsics is not None and anew.intrinsics.fx_px == 700.0


def test_intrinsics_from_pictures_go_before_a_guess() -> None:
    config = real(nominal={**PLACE, "intrinsics": LENS})
    before = calibration_of(config)
    assert before.intrinsics is not None
    lens = before.intrinsics.model_copy(update={"from_images": True})
    before = before.model_copy(update={"intrinsics": lens, "pictures": lens})
    start = with_nominal(with_earlier(config, "all", before)).calibration
    assert start.intrinsics is not None and start.intrinsics.fx_px == 790.0
    assert start.tool_camera_xyz_m == (0.0, 0.0, 0.05)
