"""The figures of a run, checked on runs whose answers are known."""

from pathlib import Path

import numpy as np
import pytest

from rig.analysis import analyse
from rig.summary import JSON_KEYS, radius_obtained, summarise
from rig.summary_table import table
from tests.rig.fakes import P_BASE_M, RADIUS_M, Bench, make_bench


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Bench, object]:
    """A perfect run of the fakes."""
    bench = make_bench(tmp_path_factory.mktemp("run"), ["run.duration_s=5"])
    return bench, bench.run()


def test_a_perfect_rig_follows_the_ideal_response(finished) -> None:  # type: ignore[no-untyped-def]
    bench, _ = finished
    analysis = analyse(bench.data, bench.config, RADIUS_M)
    assert analysis.z[0] == pytest.approx(1 / RADIUS_M - 1 / 0.03)
    assert analysis.rms_vs_ideal < 1e-3
    assert abs(analysis.relative_error) < 1e-3
    # (1 + w t) exp(-w t) = 0.01 |z(0)| scaled to R: around 3 s at w = sqrt(2000) 0.05.
    assert 2.0 < analysis.time_to_1pct_s < 3.5


def test_motion_and_geometry_come_from_the_measured_states(finished) -> None:  # type: ignore[no-untyped-def]
    bench, _ = finished
    analysis = analyse(bench.data, bench.config, RADIUS_M)
    cruising = (analysis.motion_t_s > 0.5) & (analysis.motion_t_s < 4.5)
    assert np.allclose(analysis.speed2[cruising], 0.05**2, rtol=1e-6)
    assert np.array_equal(analysis.sigma2, analysis.speed2)  # a sphere
    assert np.allclose(analysis.target_m, P_BASE_M, atol=2e-4)
    assert np.allclose(np.linalg.norm(analysis.optical_axes, axis=1), 1.0)


def test_without_a_known_radius_no_error_figure_is_invented(finished) -> None:  # type: ignore[no-untyped-def]
    bench, _ = finished
    analysis = analyse(bench.data, bench.config, None)
    assert analysis.z is analysis.z_ideal is analysis.rms_vs_ideal is None
    assert analysis.time_to_1pct_s is analysis.relative_error is None
    assert analysis.radius_m[-1] == pytest.approx(RADIUS_M, rel=2e-3)


def test_a_perfect_guess_has_no_transient_to_compare(finished) -> None:  # type: ignore[no-untyped-def]
    bench, _ = finished
    guess_m = bench.config.estimator.radius_guess_m
    assert analyse(bench.data, bench.config, guess_m).rms_vs_ideal is None


def test_the_summary_holds_every_documented_key(finished, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    bench, outcome = finished
    analysis = analyse(bench.data, bench.config, RADIUS_M)
    summary = summarise("sphere", outcome, analysis, bench.config, "raster", 0.5, tmp_path)
    assert set(JSON_KEYS) <= set(summary)
    assert summary["radius_m"] == radius_obtained(outcome, analysis)
    assert summary["frames"] == bench.vision.seq
    assert table(summary).row_count > 10


def test_a_run_that_never_saw_its_target_has_no_radius(tmp_path: Path) -> None:
    bench = make_bench(tmp_path)
    bench.vision.hidden = lambda t_s: True
    outcome = bench.run()
    analysis = analyse(bench.data, bench.config, RADIUS_M)
    assert radius_obtained(outcome, analysis) is None
    summary = summarise("sphere", outcome, analysis, bench.config, None, 0.5, tmp_path)
    assert summary["radius_m"] is summary["relative_error"] is None
    assert table(summary).row_count > 10
