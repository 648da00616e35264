"""``setup.json``: what a run was done with, beyond its configuration; written before it moves."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.errors import ConfigError
from estimator.image.intrinsics import Intrinsics
from rig.config import TargetKind

FloatArray = NDArray[np.float64]

SETUP_NAME = "setup.json"


@dataclass(frozen=True, slots=True)
class RunSetup:
    """The geometry in use, where it is from, and what a simulated rig knows besides."""

    target: TargetKind
    intrinsics: Intrinsics
    T_tool_camera: FloatArray  # (4, 4)
    radius_true_m: float | None  # None on real hardware
    renderer: str | None  # None on real hardware
    calibration: str  # where the geometry is from, in words
    started_at: str  # local date and time, YYYYmmdd-HHMMSS


def write_setup(run_dir: Path, setup: RunSetup) -> None:
    """Write ``setup.json``."""
    text = json.dumps(setup_values(setup), indent=2, allow_nan=False)
    (run_dir / SETUP_NAME).write_text(text + "\n", encoding="utf-8")


def setup_values(setup: RunSetup) -> dict[str, Any]:
    """What JSON takes of it."""
    lens = setup.intrinsics
    return {
        "target": setup.target,
        "started_at": setup.started_at,
        "calibration": setup.calibration,
        "intrinsics": {
            "fx_px": lens.fx_px,
            "fy_px": lens.fy_px,
            "cx_px": lens.cx_px,
            "cy_px": lens.cy_px,
            "distortion": np.asarray(lens.distortion, dtype=float).tolist(),
        },
        "T_tool_camera": setup.T_tool_camera.tolist(),
        "radius_true_m": setup.radius_true_m,
        "renderer": setup.renderer,
    }


def read_setup(run_dir: Path) -> RunSetup:
    """Read it back; raises ConfigError when the directory holds none that can be read."""
    path = run_dir / SETUP_NAME
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        return setup_of(values)
    except FileNotFoundError as error:
        raise ConfigError(f"{run_dir} holds no run: {SETUP_NAME} is missing") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path} cannot be read: {error!r}") from error


def setup_of(values: dict[str, Any]) -> RunSetup:
    """The setup that ``setup_values`` described; raises KeyError, TypeError or ValueError."""
    lens = values["intrinsics"]
    return RunSetup(
        target=values["target"],
        intrinsics=Intrinsics(
            lens["fx_px"],
            lens["fy_px"],
            lens["cx_px"],
            lens["cy_px"],
            np.array(lens["distortion"], dtype=float),
        ),
        T_tool_camera=np.array(values["T_tool_camera"], dtype=float).reshape(4, 4),
        radius_true_m=values["radius_true_m"],
        renderer=values["renderer"],
        calibration=values["calibration"],
        started_at=values["started_at"],
    )
