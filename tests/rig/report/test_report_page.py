"""The report in a real browser: drawn, free of errors, and with the summary's numbers."""

import json
from pathlib import Path

from tests.rig.browser import new_page
from tests.rig.command_line import rig
from tests.rig.log_lines import log_lines
from tests.rig.report.recorded_runs import record

FIGURES = {
    *("radius", "path", "transient", "deviation", "residual", "sigma2", "speed2", "speed"),
    *("events", "lateness", "latency"),
}
OBSERVER = ("--set", "estimator.kind=observer")
DRAWN = """() => Object.fromEntries([...document.querySelectorAll('.plot')].map(div => [div.id,
  div.data.map(trace => trace.type).concat(
    div.querySelector('canvas, .trace, .point') ? [] : ['nothing drawn'])]))"""


def test_two_runs_are_overlaid_on_one_page_without_network(tmp_path: Path) -> None:
    summaries = [
        record(tmp_path / "a", *OBSERVER, "--set", "sim.camera.drop_probability=0.2"),
        record(tmp_path / "b", *OBSERVER, "--set", "estimator.alpha=8000", "--no-report"),
    ]
    assert (tmp_path / "a" / "report.html").is_file()
    assert not (tmp_path / "b" / "report.html").exists()
    both = tmp_path / "both"
    runs = (str(tmp_path / "a"), str(tmp_path / "b"))
    assert rig("report", *runs, "--out", str(both)).exit_code == 0
    assert (both / "report.png").stat().st_size > 10_000
    requests = []
    with new_page(640, 480) as page:
        page.on("request", lambda request: requests.append(request.url))
        page.goto((both / "report.html").as_uri())
        page.wait_for_selector("body[data-drawn]")
        drawn = page.evaluate(DRAWN)
        cells = page.eval_on_selector_all(
            "td[data-key]", "cells => cells.map(c => [c.dataset.run, c.dataset.key, c.innerText])"
        )
        images = page.eval_on_selector_all("img", "images => images.map(i => i.naturalWidth)")
        radii = page.eval_on_selector_all(".radius", "cards => cards.map(c => c.innerText)")
        times = page.evaluate("document.getElementById('events').data[0].x")
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert set(drawn) == FIGURES
    assert not [name for name, kinds in drawn.items() if "nothing drawn" in kinds]
    assert {"scatter3d", "cone", "surface"} <= set(drawn["path"])
    for index, summary in enumerate(summaries):
        shown = {key: json.loads(text) for run, key, text in cells if run == str(index)}
        assert shown == summary
        assert radii[index].startswith(f"{1e3 * summary['radius_m']:.4f}")
    assert len(images) >= 6 and set(images) == {640}
    log = log_lines(tmp_path / "a")
    assert len(times) == len([entry for entry in log if entry["kind"] == "event"])


def figures_of(run: Path) -> dict:
    page = (run / "report.html").read_text()
    return json.loads(page.rpartition("const figures = ")[2].partition(";\n")[0])


def test_a_filters_run_shows_its_interval_and_what_the_observer_would_have_said(
    tmp_path: Path,
) -> None:
    summary = record(tmp_path / "run", "--set", "estimator.kind=kalman")
    figures = figures_of(tmp_path / "run")
    assert set(figures) == FIGURES
    names = [line["name"] for line in figures["transient"]["data"]]
    assert any("observer" in name for name in names)
    bounds = figures["radius"]["data"][:2]
    assert [len(bound["y"]) for bound in bounds] == [len(figures["radius"]["data"][2]["y"])] * 2
    assert f"{1e3 * summary['radius_std_m']:.4f}" in (tmp_path / "run" / "report.html").read_text()


def test_what_no_run_has_anything_for_is_left_out(tmp_path: Path) -> None:
    record(tmp_path / "run", "--no-report")
    setup = tmp_path / "run" / "setup.json"
    setup.write_text(json.dumps({**json.loads(setup.read_text()), "radius_true_m": None}))
    assert rig("report", str(tmp_path / "run")).exit_code == 0
    assert set(figures_of(tmp_path / "run")) == FIGURES - {"deviation"}  # nothing to compare with
