"""The paper's observer on a finished run's images, whichever estimator made the run."""

import numpy as np
from numpy.typing import NDArray

from estimator.models.cylinder import Cylinder
from estimator.models.model import Model
from estimator.models.sphere import Sphere
from estimator.observer import Observer
from estimator.twist_history import MotionUnknownError, TwistHistory
from rig.config import EstimatorConfig, TargetKind
from rig.run_data import RunData

FloatArray = NDArray[np.float64]


def paper_observer(config: EstimatorConfig, target: TargetKind) -> Observer:
    """The observer that the configuration describes, whether or not it chooses it."""
    model: Model = Sphere() if target == "sphere" else Cylinder()
    return Observer(model, *config.gains(target), config.radius_guess_m)


def observer_chi(data: RunData, config: EstimatorConfig) -> FloatArray | None:
    """χ̂ (k,) of the paper's observer after each image that the run's own estimator used.

    The camera moved as that estimator wanted; apart from this the observer would have answered
    the same live. None where the features were not kept, or where images and motion are such
    that the observer has no answer.
    """
    if len(data.features) != len(data.updates):
        return None
    try:
        return _again(data, config)
    except (MotionUnknownError, ArithmeticError):
        return None


def _again(data: RunData, config: EstimatorConfig) -> FloatArray:
    arm = data.arm_track()
    motion = TwistHistory(span_s=float("inf"))
    motion.extend(arm.t_s, arm.twist_camera)
    observer = paper_observer(config, data.target)
    chi = np.empty(len(data.updates))
    for k, (update, feature) in enumerate(zip(data.updates, data.features, strict=True)):
        observer.correct(feature, update.t_s, motion)
        estimate = observer.estimate
        assert estimate is not None  # it has just been corrected
        chi[k] = estimate.chi
    return chi
