"""The camera's intrinsics from the command line: numbers, or a YAML file."""

from pathlib import Path

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from drivers.errors import ConfigError
from estimator.image.intrinsics import Intrinsics

_NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
_FORM = "fx,fy,cx,cy[,k1,k2,p1,p2,k3]"


class _File(BaseModel):
    """The YAML form; lengths in px."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    fx: float = Field(gt=0.0)
    fy: float = Field(gt=0.0)
    cx: float
    cy: float
    distortion: list[float] = Field(default_factory=list, max_length=5)


def read_intrinsics(text: str) -> Intrinsics:
    """Intrinsics from ``fx,fy,cx,cy[,k1,k2,p1,p2,k3]`` or from the YAML file of that name.

    Coefficients left out are zero. Raises ConfigError that names what is wrong.
    """
    parts = text.split(",")
    if len(parts) == 1 or Path(text).is_file():
        return _from_file(Path(text))
    if not 4 <= len(parts) <= len(_NAMES):
        raise ConfigError(f"--intrinsics {text!r}: {len(parts)} numbers, expected {_FORM}")
    values = []
    for name, part in zip(_NAMES, parts, strict=False):
        try:
            values.append(float(part))
        except ValueError as error:
            raise ConfigError(f"--intrinsics {text!r}: {name} is {part!r}, no number") from error
    fx, fy, cx, cy = values[:4]
    return _validated(
        f"--intrinsics {text!r}",
        {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "distortion": values[4:]},
    )


def _from_file(path: Path) -> Intrinsics:
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ConfigError(f"--intrinsics: no file {path}, and not of the form {_FORM}") from error
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"--intrinsics file {path} cannot be read as YAML: {error}") from error
    if isinstance(data, dict) and isinstance(data.get("intrinsics"), dict):
        data = data["intrinsics"]
    if not isinstance(data, dict):
        raise ConfigError(f"--intrinsics file {path}: expected keys fx, fy, cx, cy, distortion")
    return _validated(f"--intrinsics file {path}", data)


def _validated(source: str, data: dict[str, object]) -> Intrinsics:
    try:
        file = _File.model_validate(data)
    except ValidationError as error:
        problems = "; ".join(
            f"{'.'.join(str(part) for part in item['loc'])}: {item['msg']}"
            for item in error.errors()
        )
        known = ", ".join(_File.model_fields)
        raise ConfigError(f"{source}: {problems} (known keys: {known})") from error
    distortion = np.zeros(5)
    distortion[: len(file.distortion)] = file.distortion
    return Intrinsics(file.fx, file.fy, file.cx, file.cy, distortion)
