"""The motion section: how the camera moves."""

from typing import Annotated, Literal

from pydantic import Field

from rig.config_section import Finite, NotNegative, Positive, Section


class ServoConfig(Section):
    """Where `rig run --servo` brings the target: a place in the image, and a distance."""

    # Of a sphere's centre, or of the point of a cylinder's axis nearest to the camera; left out:
    # the principal point.
    position_px: tuple[Finite, Finite] | None = None
    distance_m: Positive = 0.25  # from the camera's centre to the target's surface
    gain_per_s: Annotated[float, Field(gt=0, le=10)] = 2.0  # of the distance
    tolerance_px: Positive = 2.0
    tolerance_m: Positive = 0.001
    # What the motion that the task leaves free is for; none: the straight way.
    null_space: Literal["information", "none"] = "information"


class MotionConfig(Section):
    """How the camera moves, in its own axes."""

    # information: to where the radius becomes known soonest; circle: a plain arc.
    # servo: to a wanted place, see there; around the target meanwhile, as long as that tells.
    policy: Literal["constant", "paper", "information", "circle", "servo"] = "constant"
    velocity_m_s: tuple[Finite, Finite, Finite] = (-0.05, 0.0, 0.0)
    k1: NotNegative = 10.0  # eq. (24): holds the norm of v
    k2: NotNegative = 1.0  # eq. (24): turns v towards the largest sigma1²
    circle_radius_m: Positive = 0.03
    # How far information may take the camera from the target's surface, for the sake of focus;
    # how near it may, stands under safety.
    max_target_distance_m: Positive = 1.0
    centring_gain_per_s: Annotated[float, Field(gt=0, le=10)] = 5.0
    servo: ServoConfig = ServoConfig()
