"""What all sections of the simulated rig's configuration share."""

from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

Vec3 = tuple[float, float, float]
Pose = tuple[float, float, float, float, float, float]  # x, y, z in m, rotation vector in rad
Grey = Annotated[float, Field(ge=0.0, le=255.0)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class Section(BaseModel):
    """A level of the tree: unknown keys are errors, values cannot change after loading."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def check_direction(key: str, direction: Vec3) -> None:
    """Raise ValueError for a direction that points nowhere."""
    if float(np.linalg.norm(direction)) < 1e-9:
        raise ValueError(f"{key} must not be the zero vector")
