"""The paper's experiments on rendered pixels: every curve follows (5); fig. 5 shows its point."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.live import QuietView
from rig.reproduce import FIGURES, load_experiment, run_curve
from rig.run import RunResult
from tests.rig.command_line import rig

CURVES = {
    "fig3": ["case I", "case II"],
    "fig4": ["c*", "2 c*", "0.5 c*"],
    "fig5": ["case I", "case II", "case III"],
}


def test_the_experiments_use_the_papers_numbers() -> None:
    fig3, fig4, fig5 = (load_experiment(name) for name in FIGURES)
    assert [c.config["motion"]["velocity_m_s"] for c in fig3.curves] == [
        [-0.05, 0.0, 0.0],
        [0.0, 0.045, 0.02],
    ]
    assert {c.config["estimator"]["alpha"] for c in (*fig3.curves, *fig4.curves)} == {2000.0}
    assert [c.config["estimator"]["damping"] for c in fig4.curves] == [1.0, 2.0, 0.5]
    assert [c.config["motion"]["k2"] for c in fig5.curves] == [1.0, 0.0, 1.0]
    assert {c.config["motion"]["k1"] for c in fig5.curves} == {10.0}
    assert {c.config["estimator"]["alpha"] for c in fig5.curves} == {500.0}
    assert [c.config["motion"]["velocity_m_s"] for c in fig5.curves] == [
        [-0.01, 0.05, 0.05],
        [-0.01, 0.05, 0.05],
        [-0.05, 0.05, 0.01],
    ]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, RunResult]]:
    """Every curve of every figure, run once."""
    out = tmp_path_factory.mktemp("figures")
    return {
        figure: {
            curve.name: run_curve(
                figure, curve, ["sim.renderer=raster"], out, QuietView(), lambda: False
            )
            for curve in load_experiment(figure).curves
        }
        for figure in FIGURES
    }


@pytest.mark.parametrize(
    ("figure", "curve"), [(figure, name) for figure, names in CURVES.items() for name in names]
)
def test_every_curve_follows_the_response_that_5_promises(
    figure: str, curve: str, results: dict[str, dict[str, RunResult]]
) -> None:
    analysis = results[figure][curve].analysis
    assert analysis.rms_vs_ideal is not None and analysis.rms_vs_ideal <= 5e-3
    assert analysis.relative_error is not None and abs(analysis.relative_error) < 1e-2
    assert results[figure][curve].summary["frames_lost"] == 0


def test_both_starts_of_fig_3_are_different_and_converge_alike(
    results: dict[str, dict[str, RunResult]],
) -> None:
    one, two = (results["fig3"][name].analysis for name in CURVES["fig3"])
    assert np.linalg.norm(one.path_m[0] - two.path_m[0]) > 0.1
    times = np.linspace(0.0, 5.5, 50)
    z_one, z_two = (np.interp(times, a.t_s, a.z / a.z[0]) for a in (one, two))
    assert np.abs(z_one - z_two).max() < 0.03  # ‖v‖ of case II is 0.0492, not 0.05


def test_fig_5_turns_the_motion_across_the_axis_in_cases_I_and_III_only(
    results: dict[str, dict[str, RunResult]],
) -> None:
    for name, result in results["fig5"].items():
        sigma2 = float(result.analysis.sigma2[-100:].mean())
        speed2 = float(result.analysis.speed2[-100:].mean())
        assert speed2 == pytest.approx(0.0051, rel=0.01)
        if name == "case II":
            assert sigma2 < 0.85 * speed2
        else:
            assert sigma2 == pytest.approx(speed2, rel=0.01)


def test_the_command_prints_one_object_a_curve_and_draws_the_figure(tmp_path: Path) -> None:
    quick = ("--set", "sim.renderer=raster", "--set", "run.duration_s=1")
    result = rig("reproduce", "fig5", "--json", "--out", str(tmp_path), *quick)
    assert result.exit_code == 0, result.stderr
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert [line["curve"] for line in lines] == CURVES["fig5"]
    for line in lines:
        assert set(line) == {"figure", "curve", "rms_vs_ideal", "radius_m", "relative_error"}
        assert line["figure"] == "fig5"
    picture = cv2.imread(str(tmp_path / "fig5.png"))
    assert picture.shape[0] > 300 and len(np.unique(picture)) > 50
