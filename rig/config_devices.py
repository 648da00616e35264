"""Which camera and which arm: ``driver`` chooses, and the driver's own keys follow."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from drivers.camera.settings import CameraSettings
from drivers.grbl.settings import GrblSettings
from drivers.ur.settings import UrSettings
from rig.config_section import Section

Method = Literal["limb", "moments"]
# The arm stops by itself this long after the last command: a few missed ticks.
Hold = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]


class SimCamera(Section):
    """The simulated camera; what it is like stands under ``sim.camera``."""

    driver: Literal["sim"] = "sim"
    method: Method = "limb"  # how images are measured


class OpenCvCamera(CameraSettings):
    """A camera, stream or recording through OpenCV."""

    driver: Literal["opencv"] = "opencv"
    method: Method = "limb"


UrModel = Literal["UR3", "UR5", "UR10", "UR3e", "UR5e", "UR10e", "UR16e", "UR20", "UR30"]


class SimArm(Section):
    """The simulated gantry; what it is like stands under ``sim.arm``."""

    driver: Literal["sim"] = "sim"
    hold_s: Hold = 0.05


class UrArm(UrSettings):
    """A Universal Robots arm over RTDE."""

    driver: Literal["ur"] = "ur"
    hold_s: Hold = 0.05
    # Only for planning without the arm (`rig calibrate --dry-run`): connected, it is recognised.
    model: UrModel | None = None


class GrblArm(GrblSettings):
    """A serial gantry with a grblHAL or Grbl controller."""

    driver: Literal["grbl"] = "grbl"
    hold_s: Hold = 0.1


def driver_of(value: Any) -> str:
    """The ``driver`` of a section as read or as validated; the simulated one by default."""
    if isinstance(value, dict):
        return str(value.get("driver", "sim"))
    return str(getattr(value, "driver", "sim"))


CameraConfig = Annotated[
    Annotated[SimCamera, Tag("sim")] | Annotated[OpenCvCamera, Tag("opencv")],
    Discriminator(driver_of),
]
ArmConfig = Annotated[
    Annotated[SimArm, Tag("sim")] | Annotated[UrArm, Tag("ur")] | Annotated[GrblArm, Tag("grbl")],
    Discriminator(driver_of),
]
