"""How much faster than real time the whole simulated run is, by target, with the raster renderer.

Run with ``python -m benchmarks.bench_run``. The first run of each target compiles and warms up
and is not counted.
"""

import statistics
import tempfile
from pathlib import Path
from typing import get_args

from rig.config import TargetKind
from rig.config_load import load_config
from rig.live import QuietView
from rig.records import make_run_dir
from rig.run import execute

RUNS = 5


def main() -> None:
    """Print simulated seconds per wall second: median, least, most."""
    print(f"{'target':10} {'median':>8} {'min':>8} {'max':>8}   sim s per wall s, {RUNS} runs")
    for target in get_args(TargetKind):
        ratios = [_ratio(target) for _ in range(RUNS + 1)][1:]
        print(f"{target:10} {statistics.median(ratios):8.2f} {min(ratios):8.2f} {max(ratios):8.2f}")


def _ratio(target: TargetKind) -> float:
    config = load_config(target, None, ["sim.renderer=raster"])
    with tempfile.TemporaryDirectory() as folder:
        run_dir = make_run_dir(Path(folder) / "run", target)
        result = execute(config, target, run_dir, False, QuietView(), lambda: False)
    sim_s, wall_s = result.summary["sim_s"], result.summary["wall_s"]
    assert isinstance(sim_s, float) and isinstance(wall_s, float)
    return sim_s / wall_s


if __name__ == "__main__":
    main()
