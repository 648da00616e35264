"""A ball's instant under a rolling shutter: the row where it stands, not the image's middle."""

from typing import Any

import numpy as np
import pytest

from drivers.errors import ConfigError
from drivers.interfaces import ArmState, Frame
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import Intrinsics
from rig.config import TargetKind
from rig.config_load import load_config
from rig.rolling_shutter import RollingShutter
from rig.run import make_fusion
from rig.run_data import RunData
from rig.vision import Sighting

CAMERA = Intrinsics(800.0, 800.0, 319.5, 239.5)
GIVEN = (
    "calibration.intrinsics={fx_px: 800, fy_px: 800, cx_px: 319.5, cy_px: 239.5}",
    "calibration.row_time_s=3e-5",
    "calibration.latency_s=0.01",
)


class NoLog:
    """Writes nothing down."""

    def states(self, *_: Any) -> None: ...

    def frame(self, *_: Any) -> None: ...

    def estimate(self, *_: Any) -> None: ...

    def event(self, *_: Any) -> None: ...


def centre(row: float) -> np.ndarray:
    """Where a ball of 2 cm, 30 cm away, has its centre when it is seen in ``row``."""
    return 15.0 * np.array([0.1, (row - 239.5) / 800.0, 1.0])


@pytest.mark.parametrize(("row", "rows"), [(239.5, 0.0), (339.5, 100.0), (39.5, -200.0)])
def test_it_is_the_row_of_the_ball_s_centre_that_counts(row: float, rows: float) -> None:
    after_s = RollingShutter(3e-5, CAMERA).after_middle_s(centre(row), height=480)
    assert after_s == pytest.approx(3e-5 * rows, abs=1e-12)


@pytest.mark.parametrize(("target", "rows"), [("sphere", 100.0), ("cylinder", 0.0)])
def test_a_run_uses_a_ball_at_its_row_s_instant_and_a_pipe_at_the_middle_s(
    target: TargetKind, rows: float
) -> None:
    data = RunData(target=target, T_tool_camera=np.eye(4))
    fusion = make_fusion(load_config(target, None, GIVEN), target, data, NoLog())
    fusion.add_states([ArmState(0.01 * k, np.eye(4), np.zeros(6)) for k in range(10)])
    axis = None if target == "sphere" else np.array([1.0, 0.0, 0.0])
    s = centre(339.5)
    seen = Feature(s if axis is None else s - (axis @ s) * axis, 1e-6 * np.eye(3), axis)
    frame = Frame(np.zeros((480, 640), np.uint8), 0.05, 0.001, 0, "sim")
    fusion.add_sightings([Sighting(frame, Measurement(seen))], 0.06)
    fusion.advance(0.06)
    assert data.updates[-1].t_s == pytest.approx(0.05 - 0.01 + rows * 3e-5, abs=1e-9)


def test_a_row_time_without_intrinsics_is_refused() -> None:
    with pytest.raises(ConfigError, match="row_time_s goes with intrinsics"):
        load_config("sphere", None, ["calibration.row_time_s=3e-5"])
