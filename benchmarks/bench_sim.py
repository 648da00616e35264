"""What the simulated rig costs: ms per frame by renderer, and physics per simulated second.

Run with ``python -m benchmarks.bench_sim``; times are of the processor, all threads together.
"""

import time
from collections.abc import Callable

import numpy as np

from sim_backend.clock import SimulatedClock
from sim_backend.config import SimConfig
from sim_backend.gl_context import why_no_gl
from sim_backend.rig import SimulatedRig
from sim_backend.scene import SceneKind

TWISTS = {
    "board": np.array([-0.05, 0.03, 0.0, 0.0, 0.0, 0.1]),
    "sphere": np.array([-0.06, 0.0, 0.0, 0.0, -0.185, 0.0]),
    "cylinder": np.array([-0.03, 0.02, 0.05, 0.05, 0.08, 0.0]),
}


def cost_s(work: Callable[[], object]) -> float:
    """Processor seconds of one call, in whichever threads."""
    start_s = time.process_time()
    work()
    return time.process_time() - start_s


def frames_ms(target: SceneKind, renderer: str, count: int) -> tuple[float, float]:
    """Median and 99th percentile of the cost of a frame, everything included."""
    clock = SimulatedClock()
    rig = SimulatedRig(SimConfig.model_validate({"renderer": renderer}), target, clock)
    rig.camera.read(1.0)  # compiles
    costs = []
    for _ in range(count):
        rig.arm.command_twist(TWISTS[target], 1.0)
        rig.arm.read_states()
        costs.append(1e3 * cost_s(lambda: rig.camera.read(1.0)))
    rig.close()
    return float(np.median(costs)), float(np.percentile(costs, 99))


def physics_ms() -> float:
    """Of a simulated second: commands at 100 Hz, all states read."""
    clock = SimulatedClock()
    rig = SimulatedRig(SimConfig(renderer="raster"), "sphere", clock)

    def run(seconds: int) -> None:
        for _ in range(100 * seconds):
            clock.sleep_until(clock.now_s() + 0.01)
            rig.arm.command_twist(TWISTS["sphere"], 0.05)
            rig.arm.read_states()

    run(1)
    return 1e3 * cost_s(lambda: run(4)) / 4


def main() -> None:
    """Print the table."""
    print(f"physics and arm, per simulated second: {physics_ms():6.1f} ms")
    reason = why_no_gl()
    for renderer in ("raster", "gl"):
        if renderer == "gl" and reason:
            print(f"gl: not here ({reason})")
            continue
        targets: tuple[SceneKind, ...] = ("sphere", "cylinder", "board")
        for target in targets:
            median, worst = frames_ms(target, renderer, 100 if renderer == "raster" else 30)
            print(f"{renderer:7s} {target:9s} per frame: {median:6.2f} ms, p99 {worst:6.2f} ms")


if __name__ == "__main__":
    main()
