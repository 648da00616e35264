"""Whether the estimate has settled, judged without knowing the truth."""

from typing import Protocol

import numpy as np

from estimator.gain import REST_SIGMA, damping_rates
from estimator.second_order import exact_step
from rig.config import RigConfig
from rig.run_data import RunData

_WINDOW_S = 1.0
# Fewer images cannot have shown whether they agree.
_FEWEST_IMAGES = 6


class Convergence(Protocol):
    """Judges, from the updates so far, how near the end the estimate is."""

    @property
    def remaining_fraction(self) -> float:
        """By which share the estimate may still be off, at most 1."""
        ...

    def update(self) -> None:
        """Take the updates made since the last call into account."""
        ...

    def reached(self) -> bool:
        """Whether the estimate is as good as the configuration asks for."""
        ...


def make_convergence(config: RigConfig, data: RunData) -> Convergence:
    """What fits the configured estimator: its stated interval, or its predicted transient."""
    if config.estimator.chosen == "observer":
        return TransientConvergence(config, data)
    return IntervalConvergence(config, data)


class IntervalConvergence:
    """Follows the stated 95 % interval of the radius."""

    def __init__(self, config: RigConfig, data: RunData) -> None:
        run = config.run
        self._share = run.converged_fraction if run.until_share is None else run.until_share
        self._data = data
        self.remaining_fraction = 1.0

    def update(self) -> None:
        """Look at the newest update."""
        if self._data.updates:
            self.remaining_fraction = min(1.0, self._data.updates[-1].interval_share)

    def reached(self) -> bool:
        """Whether the interval is inside the share asked for, and nothing contradicts it."""
        updates = self._data.updates
        if len(updates) < _FEWEST_IMAGES or updates[-1].doubt:
            return False
        return self.remaining_fraction <= self._share


class TransientConvergence:
    """Follows the transient that (5) predicts for the measured motion, and the drift of R̂.

    The transient starts at 1 with the first image and is integrated with the σ1² of each
    interval; ``remaining_fraction`` is its envelope sqrt(z² + α w² / σ1²), w = −ż/α, which an
    underdamped response does not take through zero.
    """

    def __init__(self, config: RigConfig, data: RunData) -> None:
        self._alpha, self._damping = config.estimator.gains(data.target)
        self._fraction = config.run.converged_fraction
        self._data = data
        self._used = 0
        self._z, self._w = 1.0, 0.0
        self._standing = 0  # images in a row
        self.remaining_fraction = 1.0

    def update(self) -> None:
        """Take the updates made since the last call into account."""
        updates = self._data.updates
        for index in range(max(self._used, 1), len(updates)):
            duration_s = updates[index].t_s - updates[index - 1].t_s
            self._advance(duration_s, self._data.sigma2_at(index))
        self._used = len(updates)

    def reached(self) -> bool:
        """Whether the rest of the transient and the drift over the last second are both small."""
        updates = self._data.updates
        if self.remaining_fraction > self._fraction:
            return False
        last = updates[-1]
        recent = [u.chi for u in updates if u.t_s >= last.t_s - _WINDOW_S]
        return bool(np.ptp(recent) <= self._fraction * abs(last.chi))

    def _advance(self, duration_s: float, sigma2: float) -> None:
        alpha = self._alpha
        c = damping_rates(np.array(np.sqrt(sigma2)), alpha, self._damping)
        step = exact_step(alpha, np.array(sigma2), c, np.array(duration_s))
        z, w = self._z, self._w
        self._z = float(step.zz * z + step.zw * w)
        self._w = float(step.wz * z + step.ww * w)
        # The observer holds its estimate for a standing camera, see ``rest_rates``; one that
        # merely reverses stands for less than two images.
        self._standing = self._standing + 1 if sigma2 < REST_SIGMA**2 else 0
        if self._standing >= 2:
            self._w = 0.0
        kinetic = alpha * self._w**2 / sigma2 if sigma2 > 0 else 0.0
        self.remaining_fraction = min(1.0, float(np.sqrt(self._z**2 + kinetic)))
