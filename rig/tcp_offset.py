"""The tool centre point set on the arm, which the hand-eye transform of a calibration holds for."""

from collections.abc import Sequence

import numpy as np

from drivers.interfaces import Arm
from rig.calibration.errors import UnusableCalibrationError
from rig.calibration.result import Fingerprints

Six = tuple[float, float, float, float, float, float]

_SAME = 2e-5  # m and rad; a fingerprint has five decimals


def tcp_fingerprint(arm: Arm) -> Fingerprints:
    """What the open arm adds to a calibration's fingerprints; nothing where it keeps no TCP."""
    offset = arm.tcp_offset()
    return (
        {} if offset is None else {"tcp": " ".join(f"{x + 0.0:.5f}" for x in np.round(offset, 5))}
    )


def tcp_of(depends_on: Fingerprints) -> Six | None:
    """The TCP (x, y, z in m, rotation vector in rad) that a part of a calibration was made with."""
    text = depends_on.get("tcp")
    if text is None:
        return None
    try:
        x, y, z, rx, ry, rz = (float(part) for part in text.split())
    except ValueError as error:
        raise UnusableCalibrationError(f"{text!r} is no TCP: make the calibration anew") from error
    return x, y, z, rx, ry, rz


def check_tcp(arm: Arm, calibrated: Six | None) -> None:
    """Raise UnusableCalibrationError when the arm has another TCP than when ``calibrated``."""
    now = None if calibrated is None else arm.tcp_offset()
    if calibrated is None or now is None or np.abs(np.subtract(now, calibrated)).max() <= _SAME:
        return
    raise UnusableCalibrationError(
        f"the TCP set on the arm is {_text(now)}, the calibration in use was made with "
        f"{_text(calibrated)} (x, y, z in m, rotation vector in rad): set it back on the pendant, "
        "or calibrate with this one: `rig calibrate`"
    )


def _text(offset: Sequence[float] | np.ndarray) -> str:
    return "(" + ", ".join(f"{float(x) + 0.0:.5f}" for x in offset) + ")"
