"""What a calibration limits the radius to, against drawing calibrations at random."""

from pathlib import Path

import numpy as np
import pytest

from estimator.image.feature import Feature
from estimator.image.intrinsics import Intrinsics
from estimator.image.outline import outline_px
from estimator.twist_history import TwistHistory
from rig.calibration import se3
from rig.calibration.spread import CAMERA, INTRINSICS, LATENCY, UNKNOWNS
from rig.calibration_limits import calibration_limits
from rig.frames import invert, twist_map
from rig.run import make_observer
from tests.rig.fakes import INTRINSICS as LENS
from tests.rig.fakes import RADIUS_M, Bench, make_bench

# A middling calibration: 0.5 mm, 0.1°, 0.3 % of f, 1 px, 1 ms.
STD = np.array([*[5e-4] * 3, *[2e-3] * 3, 2.4, 2.4, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-3])
FX = INTRINSICS.start


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    bench = make_bench(tmp_path_factory.mktemp("run"), ["run.duration_s=3"])
    bench.loop.run()
    return bench


def radius_m(bench: Bench, step: np.ndarray) -> float:
    """The radius with a calibration that is off by ``step``, outline pixel by outline pixel."""
    T_tool_camera = bench.data.T_tool_camera @ se3.exp(step[CAMERA])
    states = bench.data.arm_states
    motion = TwistHistory(span_s=100.0, max_extrapolation_s=0.1)
    to_camera = twist_map(invert(T_tool_camera))
    motion.extend([one.t_s for one in states], [to_camera @ one.twist_tool for one in states])
    fx, fy, cx, cy, *d = step[INTRINSICS]
    lens = Intrinsics(
        LENS.fx_px + fx, LENS.fy_px + fy, LENS.cx_px + cx, LENS.cy_px + cy, np.array(d)
    )
    observer = make_observer(bench.config, "sphere")
    for update in bench.data.updates:
        pixels = outline_px(Feature(update.s, np.eye(3)), LENS, (480, 640))[0][:-1]
        rays = np.column_stack([lens.normalise(pixels), np.ones(len(pixels))])
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        m = np.linalg.lstsq(rays, np.ones(len(rays)), rcond=None)[0]
        s = m / np.sqrt(m @ m - 1.0)
        observer.correct(Feature(s, 1e-8 * np.eye(3)), update.t_s - step[LATENCY], motion)
    assert observer.estimate is not None
    return float(observer.estimate.radius_m or np.nan)


def limits(bench: Bench, covariance: np.ndarray) -> tuple[float, dict[str, float]]:
    found = calibration_limits(bench.data, bench.config, LENS, covariance, make_observer)
    assert found is not None
    return found.total_m, found.parts_m


def test_the_deviation_is_that_of_calibrations_drawn_at_random(finished: Bench) -> None:
    random = np.random.default_rng(1)
    covariance = np.diag(STD**2)
    # A principal point that is off goes with a camera that is turned.
    for pixel, turn, sign in ((FX + 2, 4, -1.0), (FX + 3, 3, 1.0)):
        covariance[pixel, turn] = covariance[turn, pixel] = sign * 0.9 * STD[pixel] * STD[turn]
    root = np.linalg.cholesky(covariance + 1e-18 * np.eye(UNKNOWNS))
    drawn = [radius_m(finished, root @ random.standard_normal(UNKNOWNS)) for _ in range(40)]
    total_m, parts_m = limits(finished, covariance)
    assert np.std(drawn) == pytest.approx(total_m, rel=0.25)  # of 40 draws: ± 11 %
    undisturbed_m = radius_m(finished, np.zeros(UNKNOWNS))
    assert np.mean(drawn) == pytest.approx(undisturbed_m, abs=0.5 * total_m)
    assert set(parts_m) == {"hand_eye", "focal_length", "lens", "latency"}


@pytest.mark.parametrize(
    ("index", "part"),
    [
        (2, "hand_eye"),
        (4, "hand_eye"),
        (FX, "focal_length"),
        (FX + 2, "lens"),
        (LATENCY, "latency"),
    ],
)
def test_each_part_does_what_a_calibration_off_by_its_deviation_does(
    finished: Bench, index: int, part: str
) -> None:
    step = STD[index] * np.eye(UNKNOWNS)[index]
    total_m, parts_m = limits(finished, np.outer(step, step))
    off_m = abs(radius_m(finished, step) - radius_m(finished, np.zeros(UNKNOWNS)))
    assert total_m == pytest.approx(off_m, rel=0.02, abs=1e-9)
    assert parts_m[part] == pytest.approx(total_m)
    assert sum(parts_m.values()) == pytest.approx(total_m)  # the others do nothing


def test_a_focal_length_matters_as_much_as_it_is_off(finished: Bench) -> None:
    covariance = np.zeros((UNKNOWNS, UNKNOWNS))
    covariance[FX : FX + 2, FX : FX + 2] = (0.01 * 800.0) ** 2  # both axes together, 1 %
    assert limits(finished, covariance)[0] == pytest.approx(0.01 * RADIUS_M, rel=0.1)


def test_a_run_without_a_picture_has_no_limits(tmp_path: Path) -> None:
    bench = make_bench(tmp_path)
    bench.vision.hidden = lambda t_s: True
    bench.loop.run()
    covariance = np.diag(STD**2)
    assert calibration_limits(bench.data, bench.config, LENS, covariance, make_observer) is None
