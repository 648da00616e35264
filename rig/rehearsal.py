"""Everything that a control tick computes, computed once before any device is opened."""

import numpy as np

from estimator.active.controller import CameraMotion
from estimator.estimate import Estimator
from estimator.image.feature import Feature
from estimator.twist_history import TwistHistory
from rig.config import TargetKind

_SAMPLE_S = 0.002
_IMAGE_S = 1.0 / 30.0
_AHEAD_S = 0.04
_IMAGES = 4
_TWIST = np.array([-0.01, 0.0, 0.002, 0.0, 0.02, 0.0])
# In radii; the target stays where it is, which no motion explains, and no matter.
_SEEN = {
    "sphere": Feature(np.array([0.1, 0.2, 15.0]), 1e-8 * np.eye(3)),
    "cylinder": Feature(np.array([0.1, 0.0, 8.0]), 1e-8 * np.eye(3), np.array([0.0, 1.0, 0.0])),
}


def rehearse(estimator: Estimator, controller: CameraMotion, target: TargetKind) -> None:
    """Let an estimator and a controller of a run's kind work on made-up images for a moment.

    Compiling their kernels takes seconds the first time and loading them a tenth of a second
    later: a control tick has neither. Both objects are spent afterwards.
    """
    motion = TwistHistory(max_extrapolation_s=_AHEAD_S)
    per_image = round(_IMAGE_S / _SAMPLE_S)
    for image in range(_IMAGES):
        times = [_SAMPLE_S * (image * per_image + k) for k in range(per_image)]
        motion.extend(times, np.tile(_TWIST, (per_image, 1)))
        estimator.correct(_SEEN[target], times[0], motion)
        for ahead_s in (0.0, _AHEAD_S / 2):  # within what is known, and beyond
            controller.twist(estimator.predict(times[-1] + ahead_s, motion), _SAMPLE_S)
