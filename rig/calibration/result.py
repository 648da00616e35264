"""The calibration file: what was found, how, how well, and what it depends on."""

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Literal

import yaml
from pydantic import Field, ValidationError

from drivers.errors import ConfigError
from rig.calibration.board import BoardConfig
from rig.calibration.errors import UnusableCalibrationError
from rig.config_section import Finite, NotNegative, Positive, Section

Vec3 = tuple[Finite, Finite, Finite]
Std3 = tuple[NotNegative, NotNegative, NotNegative]
Five = tuple[Finite, Finite, Finite, Finite, Finite]
# Parts of a rig by name ("camera", "tcp", "board", "arm") and a fingerprint of each.
Fingerprints = dict[str, str]
Json = None | bool | int | float | str | Sequence["Json"] | Mapping[str, "Json"]


class IntrinsicsStd(Section):
    """Standard deviations, as the values they belong to."""

    fx_px: NotNegative
    fy_px: NotNegative
    cx_px: NotNegative
    cy_px: NotNegative
    distortion: Five


class IntrinsicsResult(Section):
    """The camera."""

    width: int
    height: int
    fx_px: Positive
    fy_px: Positive
    cx_px: Finite
    cy_px: Finite
    distortion: Five
    std: IntrinsicsStd
    obtained: str  # how, in words
    # From pictures alone.
    from_images: bool = False
    fit_px: NotNegative  # rms distance of the corners
    held_out_px: NotNegative  # the same on images the fit had not seen
    coverage: NotNegative  # share of the image's parts that held a corner
    views: int
    rejected: dict[int, str] = Field(default_factory=dict)
    depends_on: Fingerprints


class HandEyeResult(Section):
    """Where the camera sits on the tool, and where the board stood."""

    tool_camera_xyz_m: Vec3
    tool_camera_rotvec_rad: Vec3
    std_xyz_m: Std3
    std_rotvec_rad: Std3
    # (15, 15) of a small motion of the camera in its own axes (m, rad) and of the intrinsics.
    covariance: tuple[tuple[Finite, ...], ...] | None = None
    base_board_xyz_m: Vec3
    base_board_rotvec_rad: Vec3
    obtained: str
    fit_px: NotNegative
    held_out_px: NotNegative
    held_out_mm: NotNegative
    held_out_deg: NotNegative
    corner_px: NotNegative  # noise of a corner, per coordinate
    arm_m: NotNegative  # scatter of the arm's poses, per axis
    arm_rad: NotNegative
    scale: Positive  # the board's size by the arm's motion over the claimed one
    scale_std: NotNegative
    poses: int
    held_out_poses: int
    rejected: dict[int, str] = Field(default_factory=dict)
    depends_on: Fingerprints


class LatencyResult(Section):
    """An image stamped t was half exposed at t − latency_s on the arm's clock."""

    latency_s: Finite
    std_s: NotNegative
    row_time_s: Finite = 0.0
    row_time_std_s: NotNegative = 0.0
    obtained: str
    segments_s: tuple[Finite, ...]
    correlation: Finite
    depends_on: Fingerprints


class VerificationResult(Section):
    """Whether fresh motions were as predicted."""

    passed: bool
    findings: tuple[str, ...] = ()
    motions: dict[str, tuple[NotNegative, NotNegative]]  # predicted rms, mismatch rms; px
    fresh_px: NotNegative | None = None  # rms distance on poses looked from afterwards
    depends_on: Fingerprints


class Verdict(Section):
    """Whether the calibration may be used."""

    passed: bool
    reasons: tuple[str, ...] = ()


class CalibrationFile(Section):
    """Everything; a step not done yet is left out."""

    version: Literal[1] = 1
    rig: str
    made: str  # when, local time
    board: BoardConfig
    intrinsics: IntrinsicsResult | None = None
    pictures: IntrinsicsResult | None = None  # from pictures alone: hand-eye starts from them
    hand_eye: HandEyeResult | None = None
    latency: LatencyResult | None = None
    verification: VerificationResult | None = None
    verdict: Verdict | None = None


def fingerprint(value: Json) -> str:
    """A short text that changes whenever ``value`` does."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return sha256(text.encode("utf-8")).hexdigest()[:16]


def save_calibration(calibration: CalibrationFile, path: Path) -> None:
    """Write the file as a whole or not at all; raises ConfigError when it cannot be written."""
    data = calibration.model_dump(mode="json", exclude_none=True)
    text = yaml.safe_dump(
        data,
        sort_keys=False,
        allow_unicode=True,
        width=100,
        default_flow_style=None,
    )
    partial = path.with_name(f"{path.name}.partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
    except OSError as error:
        raise ConfigError(f"cannot write the calibration file {path}: {error}") from error


def load_calibration(path: Path) -> CalibrationFile:
    """Read the file; raises ConfigError that says what is wrong with it and how to get one."""
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise UnusableCalibrationError(
            f"no calibration file {path}: make it with `rig calibrate`"
        ) from error
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"cannot read the calibration file {path}: {error}") from error
    if not isinstance(data, dict):
        raise ConfigError(f"{path} holds no calibration: make it anew with `rig calibrate`")
    try:
        return CalibrationFile.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        raise ConfigError(
            f"the calibration file {path}: {where}: {first['msg']}; "
            "make it anew with `rig calibrate`"
        ) from error
