"""Builds the simulated rig; imported only when a configuration chooses it."""

from drivers.clock import Clock
from drivers.interfaces import Camera
from estimator.image.feature import Feature
from estimator.image.intrinsics import Intrinsics
from rig.build import Devices
from rig.config import RigConfig
from rig.vision.features import FeatureVision
from sim_backend.clock import SimulatedClock
from sim_backend.features import FeatureSource
from sim_backend.kinematics import tool_pose
from sim_backend.remote_camera import remote_camera
from sim_backend.rig import SimulatedRig
from sim_backend.scene import SceneKind
from sim_backend.shared_motion import SharedMotion


def build_simulated(
    config: RigConfig, target: SceneKind, clock: Clock | None, camera_elsewhere: bool
) -> Devices:
    """The simulated rig on ``clock``, or on simulated time when that is None."""
    clock = SimulatedClock() if clock is None else clock
    rig = SimulatedRig(config.sim, target, clock, camera_elsewhere)
    vision = None if rig.features is None else _features(rig.features, rig.camera, config)
    return Devices(
        camera=None if camera_elsewhere else rig.camera,
        feed=rig.feed() if camera_elsewhere else None,
        arm=rig.arm,
        clock=clock,
        intrinsics=Intrinsics(*rig.intrinsics),
        T_tool_camera=rig.T_tool_camera,
        renderer=rig.renderer_name,
        truth=rig.truth,
        features=vision,
        everything_ready=rig.skip_rest,
    )


def _features(source: FeatureSource, camera: Camera, config: RigConfig) -> FeatureVision:
    """Vision by what the simulator itself says the images show."""

    def look(t_s: float, seq: int) -> Feature | str:
        found = source.seen(t_s, seq)
        return found if isinstance(found, str) else Feature(found.s, found.covariance, found.axis)

    late_s = config.sim.camera.latency_s if config.sim.camera.stamps == "arrival" else 0.0
    return FeatureVision(camera, look, late_s)


def build_remote_camera(config: RigConfig, target: SceneKind, feed: int, clock: Clock) -> Camera:
    """The simulated camera on an arm that is simulated in the process that wrote ``feed``."""
    return remote_camera(config.sim, target, SharedMotion(feed, clock), tool_pose, clock)
