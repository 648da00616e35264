"""The exact step of equation (5) for constant σ² and c."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Step(NamedTuple):
    """(z, w) after a step: z = zz z0 + zw w0, w = wz z0 + ww w0; each of the inputs' shape."""

    zz: FloatArray
    zw: FloatArray
    wz: FloatArray
    ww: FloatArray


def exact_step(alpha: float, sigma2: FloatArray, c: FloatArray, duration_s: FloatArray) -> Step:
    """The solution of ż = −α w, ẇ = −c w + σ² z, that is z̈ + c ż + α σ² z = 0, eq. (5).

    The 2x2 exponential is e^{−ch/2} (cosh μh I + sinh(μh)/μ (M + c/2 I)), μ² = c²/4 − α σ²,
    evaluated without overflow or cancellation for every damping. Inputs broadcast.
    """
    half = 0.5 * c
    mu2 = half * half - alpha * sigma2
    mu = np.sqrt(np.abs(mu2))
    x = mu * duration_s
    envelope = np.exp(-half * duration_s)
    # Overdamped: two real poles, the slow one written so that it does not cancel.
    slow = np.exp(-alpha * sigma2 * duration_s / np.where(half + mu > 0.0, half + mu, 1.0))
    fast = envelope * np.exp(-x)
    over = mu2 >= 0.0
    cosine = np.where(over, 0.5 * (slow + fast), envelope * np.cos(x))
    near = np.abs(x) < 1e-3  # series: both branches are 0/0 at critical damping
    divisor = np.where(near, 1.0, mu)
    sine = np.where(over, 0.5 * (slow - fast), envelope * np.sin(x)) / divisor
    series = envelope * duration_s * (1.0 + np.where(over, x * x, -x * x) / 6.0)
    sine = np.where(near, series, sine)
    return Step(
        zz=cosine + half * sine,
        zw=-alpha * sine,
        wz=sigma2 * sine,
        ww=cosine - half * sine,
    )
