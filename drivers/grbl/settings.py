"""What can be configured about a serial gantry."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Vector3 = tuple[Finite, Finite, Finite]
Letter = Literal["X", "Y", "Z", "A", "B", "C"]
Joint = Literal["x", "y", "z", "roll", "pitch", "spin"]


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class AxisSettings(_Section):
    """One controller axis: which joint it moves and where that joint's zero is.

    Coordinates are the controller's machine coordinates (``MPos``), mm for slides and degrees
    for wrist axes. The optional range is kept by the driver, beside the controller's own.
    """

    letter: Letter
    joint: Joint
    sign: Literal[-1, 1] = 1
    mpos_at_zero: Finite = 0.0
    mpos_min: Finite | None = None
    mpos_max: Finite | None = None

    @model_validator(mode="after")
    def _range_not_empty(self) -> Self:
        low, high = self.mpos_min, self.mpos_max
        if low is not None and high is not None and low >= high:
            raise ValueError(f"axis {self.letter}: mpos_min must lie below mpos_max")
        return self

    @property
    def is_slide(self) -> bool:
        """Whether the joint is linear."""
        return self.joint in ("x", "y", "z")


class WristSettings(_Section):
    """Where the rotations and the tool are, all wrist joints at zero.

    The slides carry the wrist centre along base x, y, z; ``centre_xyz_m`` is its place at
    slide zero. Roll, pitch and spin turn in this order about ``*_axis``, unit vectors in the
    frame of the link before (parallel to base at zero), all through the wrist centre. The tool
    frame sits at ``tool_xyz_m`` with orientation ``tool_rotvec_rad`` in the last link. The
    defaults: about x, y and the vertical, the tool looking down.
    """

    centre_xyz_m: Vector3 = (0.0, 0.0, 0.0)
    roll_axis: Vector3 = (1.0, 0.0, 0.0)
    pitch_axis: Vector3 = (0.0, 1.0, 0.0)
    spin_axis: Vector3 = (0.0, 0.0, 1.0)
    tool_xyz_m: Vector3 = (0.0, 0.0, 0.0)
    tool_rotvec_rad: Vector3 = (3.141592653589793, 0.0, 0.0)

    @model_validator(mode="after")
    def _unit_axes(self) -> Self:
        for name in ("roll_axis", "pitch_axis", "spin_axis"):
            axis = getattr(self, name)
            if abs(sum(part * part for part in axis) - 1.0) > 1e-3:
                raise ValueError(f"wrist.{name} = {list(axis)} is not a unit vector")
        return self


_STANDARD: tuple[tuple[Letter, Joint], ...] = (
    ("X", "x"),
    ("Y", "y"),
    ("Z", "z"),
    ("A", "roll"),
    ("B", "pitch"),
    ("C", "spin"),
)


def standard_axes(count: int) -> tuple[AxisSettings, ...]:
    """X Y Z as slides and A B C as roll, pitch, spin, the first ``count`` of them."""
    return tuple(AxisSettings(letter=letter, joint=joint) for letter, joint in _STANDARD[:count])


class GrblSettings(_Section):
    """A gantry on a serial port; only ``port`` has to be given to look and jog."""

    port: Annotated[str, Field(min_length=1)]  # /dev/serial/by-id/... stays the same when moved
    # On USB CDC the board ignores it: give 1000000, it tells the driver that the line is fast.
    baud: Annotated[int, Field(ge=9600, le=20_000_000)] = 115200
    axes: tuple[AxisSettings, ...] | None = None  # None: the standard ones the controller has
    wrist: WristSettings = WristSettings()
    # A rotation that the axes cannot make: an error, or left out of the motion.
    on_rotation: Literal["refuse", "drop"] = "refuse"
    # Duration of a jog block, and blocks kept ahead; None: as fast as the line carries.
    segment_s: Annotated[float, Field(ge=0.005, le=0.05)] | None = None
    lookahead_blocks: Annotated[int, Field(ge=2, le=12)] | None = None
    poll_hz: Annotated[float, Field(ge=10, le=120)] = 55.0
    twist_window_s: Annotated[float, Field(ge=0.03, le=0.2)] = 0.07
    # Lines written but not acknowledged hold up a stop: never more bytes than this ahead.
    max_ahead_bytes: Annotated[int, Field(ge=80, le=512)] = 128
    silence_s: Annotated[float, Field(ge=0.1, le=2.0)] = 0.25
    rest_timeout_s: Annotated[float, Field(ge=0.5, le=20)] = 3.0
    # Boards that reset when the port opens need seconds to boot.
    boot_timeout_s: Annotated[float, Field(ge=0.5, le=20)] = 4.0
    # Length of a move there and back along x at start-up that measures the command delay; 0:
    # none, the delay is computed.
    self_test_mm: Annotated[float, Field(ge=0, le=5)] = 0.0

    @model_validator(mode="after")
    def _axes_fit_together(self) -> Self:
        if self.axes is None:
            return self
        letters = [axis.letter for axis in self.axes]
        joints = [axis.joint for axis in self.axes]
        for kind, names in (("letter", letters), ("joint", joints)):
            if len(set(names)) != len(names):
                raise ValueError(f"axes: a {kind} appears twice in {names}")
        if not {"x", "y", "z"} <= set(joints):
            raise ValueError(f"axes: the slides x, y and z are all needed, got {joints}")
        return self
