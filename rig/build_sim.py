"""Builds the simulated rig; imported only when a configuration chooses it."""

from drivers.clock import Clock
from estimator.image.intrinsics import Intrinsics
from rig.build import Devices
from rig.config import RigConfig, TargetKind
from sim_backend.clock import SimulatedClock
from sim_backend.rig import SimulatedRig


def build_simulated(config: RigConfig, target: TargetKind, clock: Clock | None) -> Devices:
    """The simulated rig on ``clock``, or on simulated time when that is None."""
    realtime = clock is not None
    clock = SimulatedClock() if clock is None else clock
    rig = SimulatedRig(config.sim, target, clock)
    return Devices(
        camera=rig.camera,
        arm=rig.arm,
        clock=clock,
        realtime=realtime,
        intrinsics=Intrinsics(*rig.intrinsics),
        T_tool_camera=rig.T_tool_camera,
        renderer=rig.renderer_name,
        truth=rig.truth,
    )
