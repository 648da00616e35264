"""The live page in a real browser: it shows the run as it goes, and its STOP stops the arm."""

import json
import re
import statistics
import time
from pathlib import Path

import numpy as np
import pytest

from tests.rig.browser import new_page
from tests.rig.page.watched_run import watched_run

pytestmark = pytest.mark.realtime
pytest.importorskip("viser", reason="needs the package viser")

STOP = "button:has(.icon-tabler-hand-stop)"
ALIVE = """([image, time]) => {
  const img = document.querySelector('#rig-image'), t = document.querySelector('#rig-time');
  return img && t && img.naturalWidth === 640 && img.src !== image && t.innerText !== time; }"""
RUNNING = """document.querySelector('#rig-state').innerText === 'running'
  && document.querySelector('#rig-target').innerText === 'tracking'"""
STOPPED = "document.querySelector('#rig-state').innerText.startsWith('stopped')"


def seen(page) -> list[str]:
    """The image and the time that are shown."""
    return [page.get_attribute("#rig-image", "src"), page.inner_text("#rig-time")]


def test_a_browser_sees_the_run_and_stops_it(tmp_path: Path) -> None:
    with watched_run(tmp_path / "run") as run:
        with new_page(900, 560) as page:
            page.goto(run.url)
            page.wait_for_function(ALIVE, arg=["", ""])
            before = seen(page)
            page.wait_for_function(ALIVE, arg=before)
            assert re.match(r"R̂ \d+\.\d{3} ± \d+\.\d{3} mm", page.inner_text("#rig-radius"))
            page.wait_for_function(RUNNING)
            assert page.locator("canvas").count() >= 3  # the scene and two plots
            page.click(STOP)
            page.wait_for_function(STOPPED)
        status, result = run.end()
    assert status == 130  # as after Ctrl-C
    assert result["sim_s"] < 100.0
    summary = json.loads((run.out / "summary.json").read_text())
    assert summary["ending"] == "interrupted"
    assert summary["arm_at_rest"]


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_the_first_reduced_command_follows_the_click_within_a_tenth_of_a_second(
    tmp_path: Path,
) -> None:
    latencies_s = []
    for number in range(7):
        with watched_run(tmp_path / str(number)) as run:
            with new_page(900, 560) as page:
                page.goto(run.url)
                page.wait_for_function(ALIVE, arg=["", ""])
                page.wait_for_function("document.querySelector('#rig-speed').innerText > '9'")
                clicked_s = time.monotonic()
                if number % 2:
                    page.keyboard.press("Space")
                else:
                    page.evaluate(f"document.querySelector('{STOP}').click()")
                page.wait_for_function(STOPPED)
            run.end()
        latencies_s.append(run.first_reduced_s() - clicked_s)
    print("click to first reduced command, ms:", np.round(1e3 * np.array(latencies_s)))
    assert min(latencies_s) > 0.0
    assert statistics.median(latencies_s) <= 0.1
