"""What stands at the beginning of a log: everything a replay needs that no message says."""

import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig, TargetKind
from rig.config_load import dump_config

FloatArray = NDArray[np.float64]

# Raised whenever a reader of the one before would misunderstand a log.
LOG_FORMAT = 1
PROGRAM = "activerig"
CONFIG_NAME = "config.yaml"
_VERSIONS = ("numpy", "scipy", "numba", "opencv-python-headless", "mujoco", "mcap")


@dataclass(frozen=True, slots=True)
class LogHeader:
    """What a run was: stored as metadata, numbers in JSON's exact notation."""

    target: TargetKind | Literal["board"]
    config: RigConfig
    intrinsics: Intrinsics
    T_tool_camera: FloatArray  # (4, 4)
    realtime: bool
    renderer: str | None = None
    radius_true_m: float | None = None  # simulated rigs only; for error figures
    offset_ns: int = 0  # add to the rig's clock for the time of day; 0 on simulated time
    pictures: bool = True  # False: the simulated camera's images are blank
    attachments: tuple[Path, ...] = ()  # such as the calibration's file


def metadata_of(header: LogHeader) -> dict[str, Mapping[str, str]]:
    """The metadata records by name."""
    own = header.intrinsics
    lens = [own.fx_px, own.fy_px, own.cx_px, own.cy_px, *own.distortion.tolist()]
    return {
        PROGRAM: {"format": str(LOG_FORMAT), **versions()},
        "run": _texts(
            target=header.target,
            rig=header.config.name,
            seed=header.config.sim.seed,
            realtime=header.realtime,
            renderer=header.renderer,
            radius_true_m=header.radius_true_m,
            clock_offset_ns=header.offset_ns,
        ),
        "geometry": _texts(intrinsics=lens, T_tool_camera=header.T_tool_camera.tolist()),
    }


def attachments_of(header: LogHeader) -> dict[str, bytes]:
    """The attached files by name; those that cannot be read are left out."""
    files = {CONFIG_NAME: dump_config(header.config).encode()}
    for path in header.attachments:
        if path.is_file():
            files[f"calibration/{path.name}"] = path.read_bytes()
    return files


def versions() -> dict[str, str]:
    """Of this program, of what it calculates with, and of the machine."""
    out = {"version": _version(PROGRAM), "python": platform.python_version()}
    out |= {name: _version(name) for name in _VERSIONS}
    return {**out, "machine": platform.machine(), "system": platform.platform()}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _texts(**values: Any) -> dict[str, str]:
    return {key: json.dumps(value) for key, value in values.items()}
