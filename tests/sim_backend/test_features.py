"""Features without images: exact but for noise that is as large, and as shaped, as stated."""

import numpy as np
import pytest

from drivers.errors import ConfigError
from sim_backend.clock import SimulatedClock
from sim_backend.config import SimConfig
from sim_backend.features import SeenFeature
from sim_backend.rig import SimulatedRig
from sim_backend.scene import TargetKind
from tests.sim_backend.helpers import built


def looked(target: TargetKind, count: int, **features: float) -> tuple[SimulatedRig, list]:
    rig, clock = built(target, level="features", features=features)
    rig.truth.s(clock.now_s())
    assert rig.features is not None
    return rig, [rig.features.seen(clock.now_s(), seq) for seq in range(count)]


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_without_noise_a_feature_is_the_truth(target: TargetKind) -> None:
    rig, (seen,) = looked(target, 1, noise_px=0.0)
    np.testing.assert_allclose(seen.s, rig.truth.s(0.0), rtol=1e-12)
    if target == "cylinder":
        np.testing.assert_allclose(seen.axis, rig.truth.axis(0.0), atol=1e-12)


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_errors_have_the_covariance_that_is_stated(target: TargetKind) -> None:
    rig, seen = looked(target, 3000, noise_px=0.02)
    truth = rig.truth.s(0.0)
    errors = np.array([feature.s - truth for feature in seen])
    stated = seen[0].covariance
    np.testing.assert_allclose(np.cov(errors.T), stated, atol=0.1 * np.abs(stated).max())
    # The distance is by far the least certain, across the axis and the outline's motion.
    towards = truth / np.linalg.norm(truth)
    size = float(towards @ stated @ towards)
    aside = (
        np.cross(towards, [0.0, 1.0, 0.0])
        if seen[0].axis is None
        else np.cross(seen[0].axis, towards)
    )
    aside /= np.linalg.norm(aside)
    assert size > 20.0 * float(aside @ stated @ aside)
    if target == "cylinder":
        for feature in seen[:20]:
            assert abs(float(feature.axis @ feature.s)) < 1e-9


def test_images_are_lost_and_wrong_as_often_as_configured() -> None:
    rig, seen = looked("sphere", 1500, lost_probability=0.2, outlier_probability=0.1)
    found = [feature for feature in seen if isinstance(feature, SeenFeature)]
    assert len(found) / len(seen) == pytest.approx(0.8, abs=0.03)
    truth = rig.truth.s(0.0)
    nis = np.array([(f.s - truth) @ np.linalg.solve(f.covariance, f.s - truth) for f in found])
    assert np.mean(nis > 25.0) == pytest.approx(0.1, abs=0.03)


def test_frames_keep_the_times_of_the_camera_that_draws_them() -> None:
    times = []
    for level in ("features", "pixels"):
        rig, clock = built(
            "sphere", level=level, camera={"width": 64, "height": 48, "drop_probability": 0.3}
        )
        seen = []
        for _ in range(60):
            frame = rig.camera.read(0.0)
            if frame is not None:
                seen.append((clock.now_s(), frame.seq, frame.t_exposure_mid_s))
            clock.sleep_until(clock.now_s() + 0.01)
        rig.close()
        times.append(seen)
    assert times[0] == times[1] and len(times[0]) > 8


def test_there_is_no_board_without_images() -> None:
    with pytest.raises(ConfigError, match=r"sim\.level"):
        SimulatedRig(SimConfig(level="features"), "board", SimulatedClock())
