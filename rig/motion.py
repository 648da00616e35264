"""The camera motion that a configuration asks for."""

import math
from collections.abc import Callable

import numpy as np

from estimator.active.circle import CircularVelocity
from estimator.active.controller import CameraMotion, Controller
from estimator.active.information_policy import InformationPolicy
from estimator.active.null_space import AroundTarget
from estimator.active.policy import ConstantVelocity, PaperPolicy, VelocityPolicy
from estimator.active.room import Walls
from estimator.active.servo import ServoController
from estimator.active.servo_task import ServoTask
from rig.config import RigConfig
from rig.servo import NO_LENS, servo_task


def make_controller(
    config: RigConfig,
    task: ServoTask | None = None,
    walls: Callable[[], Walls | None] = lambda: None,
) -> CameraMotion:
    """What moves the camera; ``walls`` bound it where it plans ahead.

    ``task`` is a servo's; without one (no camera is known yet) it is that of a made-up camera.
    """
    task = task or servo_task(config, NO_LENS)
    if task is not None:
        return _servo(config, task, walls)
    return Controller(_velocity(config, walls), config.motion.centring_gain_per_s)


def _velocity(config: RigConfig, walls: Callable[[], Walls | None]) -> VelocityPolicy:
    motion = config.motion
    if motion.policy == "constant":
        return ConstantVelocity(motion.velocity_m_s)
    if motion.policy == "circle":
        return CircularVelocity(motion.velocity_m_s, motion.circle_radius_m)
    if motion.policy == "information":
        least_m, most_m = config.safety.min_target_distance_m, motion.max_target_distance_m
        return InformationPolicy(motion.velocity_m_s, least_m, most_m, walls)
    return PaperPolicy(motion.velocity_m_s, motion.k1, motion.k2)


def _servo(
    config: RigConfig, task: ServoTask, walls: Callable[[], Walls | None]
) -> ServoController:
    motion = config.motion
    around = None
    if motion.servo.null_space == "information":
        around = AroundTarget(np.array(motion.velocity_m_s), walls)
    return ServoController(
        task,
        speed_m_s=math.hypot(*motion.velocity_m_s),
        wanted_share=config.wanted_share,
        around=around,
        distance_gain_per_s=motion.servo.gain_per_s,
        centring_gain_per_s=motion.centring_gain_per_s,
    )
