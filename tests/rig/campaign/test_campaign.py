"""A comparison: which runs, what they come to, and how a killed one goes on."""

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from drivers.errors import ConfigError
from rig.campaign.cases import Case, NoiseKind, cases_of, chosen
from rig.campaign.figure import draw_campaign
from rig.campaign.job import Job
from rig.campaign.sources import sources_here
from rig.campaign.store import RESULTS_NAME, Store
from rig.campaign.table import lines_of, table_of
from rig.campaign.worker import OtherSourcesError, Row, run_case
from rig.config_load import dump_config, load_config
from tests.rig.command_line import rig

pytest.importorskip("pyarrow", reason="the extra parquet is not installed")


def row(seed: int, error: float | None, time_s: float | None = 0.2, **other: object) -> Row:
    """A row of a made-up run."""
    found = error is not None
    made: Row = {
        "target": "sphere",
        "start": "default",
        "noise": "clean",
        "policy": "paper",
        "estimator": "kalman",
        "seed": seed,
        "time_to_1pct_s": time_s,
        "relative_error": error,
        "relative_std": 1e-3 if found else None,
        "relative_bound": 1e-3 if found else None,
        "nees": (error / 1e-3) ** 2 if error is not None else None,
        "path_m": 0.1,
        "frames": 90,
        "frames_lost": 9,
        "doubted": False,
        "course": [0.5, 0.01, 0.001] if found else [],
        "error": "",
    }
    made.update(other)  # type: ignore[arg-type]
    return made


def test_moving_for_information_is_for_the_filter_only() -> None:
    cases = cases_of("sphere", ["observer", "kalman"], ["paper", "information"], ["clean"], 3)
    assert len(cases) == 9 == len(set(cases))
    assert all(c.estimator == "kalman" for c in cases if c.policy == "information")


def test_a_list_names_known_kinds_once() -> None:
    assert chosen("hard, clean,hard", NoiseKind, "--noise") == ["hard", "clean"]
    for text in ("loud", "", "clean,loud"):
        with pytest.raises(ValueError, match="clean, hard"):
            chosen(text, NoiseKind, "--noise")


def test_a_line_sums_up_its_runs_and_says_what_failed() -> None:
    errors = [1e-3, -1e-3, 2e-3, -0.5e-3]
    rows = [row(k, error, 0.1 * (k + 1)) for k, error in enumerate(errors)]
    rows += [row(9, None, None), row(10, 3e-3, None)]
    (line,) = lines_of(rows)
    assert (line.runs, line.failed) == (6, 1)
    assert line.time_to_1pct_s == pytest.approx(0.3)
    assert line.time_to_1pct_90_s is None  # more than one in ten never stayed within
    assert line.rms_error == pytest.approx((15.25e-6 / 5) ** 0.5)
    assert line.efficiency == pytest.approx(line.rms_error / 1e-3)
    assert line.covered == pytest.approx(3 / 5)
    assert line.frames_lost == pytest.approx(0.1)
    assert table_of("sphere", [line]).row_count == 1


def test_a_store_keeps_rows_and_knows_what_is_missing(tmp_path: Path) -> None:
    cases = [Case("sphere", "default", "clean", "paper", "kalman", seed) for seed in range(3)]
    store = Store(tmp_path, {"a": 1})
    assert store.missing(cases) == cases
    store.add(row(0, 1e-3))
    store.add(row(2, None, None))
    store.add(row(2, 5e-3))  # once is enough
    assert len(store.rows) == 2
    store.write()
    again = Store(tmp_path, {"a": 1})
    assert again.rows == store.rows
    assert again.missing(cases) == [cases[1]]
    with pytest.raises(ConfigError, match="other settings"):
        Store(tmp_path, {"a": 2})
    (tmp_path / RESULTS_NAME).write_bytes(b"torn")
    with pytest.raises(ConfigError, match="cannot be read"):
        Store(tmp_path, {"a": 1})


def test_a_figure_is_drawn_of_whatever_there_is(tmp_path: Path) -> None:
    rows = [row(0, 1e-3), row(1, 2e-3, None, course=[0.5]), row(2, None, None)]
    rows += [row(0, None, None, noise="hard"), row(0, 1e-3, 0.0, noise="laggy")]
    draw_campaign(tmp_path / "compare.png", "sphere", rows)
    assert (tmp_path / "compare.png").stat().st_size > 10000


def test_a_run_becomes_a_row_and_a_failed_run_too(tmp_path: Path) -> None:
    case = Case("sphere", "default", "clean", "constant", "kalman", 3)
    plain = dump_config(load_config("sphere"))
    short = ("sim.level=features", "run.duration_s=0.6")
    good = run_case(Job(case, plain, short, sources_here()))
    assert good["error"] == "" and abs(float(str(good["relative_error"]))) < 5e-3
    course = good["course"]
    assert isinstance(course, list) and 11 <= len(course) <= 13
    outside = (*short, "safety.workspace_min_m=[-2, -2, 1.5]")
    bad = run_case(Job(case, plain, outside, sources_here()))
    assert "workspace" in str(bad["error"]) and bad["relative_error"] is None
    with pytest.raises(OtherSourcesError, match=r"0\.0 asking"):
        run_case(Job(case, plain, short, "0.0"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--noise", "loud"), "clean, hard"),
        (("--estimators", "observer", "--policies", "information"), "kalman"),
        (("--set", "motion.speed=1"), "motion.speed"),
        (("--starts", "sideways"), "default, axial"),
        (("--starts", "along"), "a sphere has"),
        (("--scheduler", "localhost:8786"), "tcp://HOST:PORT"),
        (("--scheduler", "tcp://127.0.0.1:9", "--jobs", "2"), "--jobs"),
    ],
)
def test_wrong_usage_is_refused_before_anything_runs(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    result = rig("compare", "--target", "sphere", "--out", str(out), *arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert not out.exists()


@pytest.mark.slow
def test_a_killed_campaign_goes_on_and_loses_and_doubles_nothing(tmp_path: Path) -> None:
    command = [
        *(sys.executable, "-c", "from rig.cli import main; main()", "compare", "--json"),
        *("--target", "sphere", "--estimators", "kalman", "--policies", "constant,circle"),
        *("--noise", "clean", "--seeds", "15", "--duration", "1", "--jobs", "2"),
        *("--out", str(tmp_path)),
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True)
    results = tmp_path / RESULTS_NAME
    try:
        while not results.exists():
            with suppress(subprocess.TimeoutExpired):
                process.wait(0.1)
                break
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
    done = len(Store(tmp_path, json.loads((tmp_path / "campaign.json").read_text())).rows)
    assert 0 < done < 30
    again = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = json.loads(again.stdout)
    assert [(line["policy"], line["runs"]) for line in lines] == [("circle", 15), ("constant", 15)]
