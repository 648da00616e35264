"""The safety section: the envelope, when to hold or stop, and how long to wait."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from rig.config_section import Finite, NotNegative, Positive, Section

Reaction = Literal["hold", "stop"]


class TableConfig(Section):
    """A plane nothing may come close to, in the base frame: ``normal · x = offset_m``."""

    normal: tuple[Finite, Finite, Finite] = (0.0, 0.0, 1.0)  # points to the free side
    offset_m: Finite = 0.0
    min_distance_m: NotNegative = 0.03  # of the tool and of the camera's centre

    @model_validator(mode="after")
    def _unit_normal(self) -> Self:
        if abs(float(np.linalg.norm(self.normal)) - 1.0) > 1e-3:
            raise ValueError(f"normal = {list(self.normal)} is not a unit vector")
        return self


class ReactionsConfig(Section):
    """What follows when something is wrong: hold until it is over, or stop for good.

    Both ramp the arm to rest. A failing device always stops the run.
    """

    no_image: Reaction = "hold"
    target_lost: Reaction = "hold"
    diverged: Reaction = "stop"
    stale_state: Reaction = "stop"
    overrun: Reaction = "hold"
    envelope: Reaction = "hold"


class SafetyConfig(Section):
    """The envelope no command leaves; limits of the tool, in the base frame where directed."""

    max_linear_speed_m_s: Positive = 0.15
    max_angular_speed_rad_s: Positive = 1.0
    max_linear_acceleration_m_s2: Positive = 1.0
    max_angular_acceleration_rad_s2: Positive = 5.0
    workspace_min_m: tuple[Finite, Finite, Finite] = (-2.0, -2.0, 0.05)
    workspace_max_m: tuple[Finite, Finite, Finite] = (2.0, 2.0, 2.0)
    table: TableConfig | None = None
    # From the camera's centre to the target's surface, as the estimate has it.
    min_target_distance_m: NotNegative = 0.05
    # The target's outline is kept this far inside the image.
    field_of_view_margin_px: NotNegative = 8.0
    # Where the arm knows its joints: how far from their ends they are kept, and the smallest
    # singular value of the tool's Jacobian (its linear rows over 0.1 m) that is not left.
    joint_margin_rad: NotNegative = 0.03
    joint_margin_m: NotNegative = 0.005
    min_singular_value: NotNegative = 0.02
    # Share of their greatest speeds, where these are known: next to a singularity a slow tool
    # takes fast joints, and a joint asked for more than it can do is a protective stop.
    joint_speed_share: Annotated[float, Field(gt=0, le=1)] = 0.5
    # Time from a command to the arm's obeying it: walls are approached that much slower.
    reaction_time_s: Annotated[float, Field(ge=0, le=1)] = 0.03
    # No image for this many of the camera's periods: something is wrong with it.
    no_image_periods: Annotated[int, Field(ge=2, le=300)] = 9
    # A feature older than this is not acted upon.
    max_feature_age_s: Positive = 0.3
    # Without images or without the target for this long the run ends.
    target_lost_after_s: Positive = 2.0
    max_state_age_s: Positive = 0.1
    # The estimate counts as diverged when, for this long, images contradict its prediction by
    # more than this share of s, or it has no positive radius.
    max_residual: Positive = 0.05
    diverged_after_s: Positive = 1.0
    # Any other reason to hold ends the run after this long; an envelope reached does not.
    hold_timeout_s: Positive = 5.0
    reactions: ReactionsConfig = ReactionsConfig()

    @model_validator(mode="after")
    def _box_not_empty(self) -> Self:
        if any(lo >= hi for lo, hi in zip(self.workspace_min_m, self.workspace_max_m, strict=True)):
            raise ValueError("workspace_min_m must lie below workspace_max_m on every axis")
        return self
