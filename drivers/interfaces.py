"""The whole hardware abstraction on one page: what a camera and an arm are to the rig.

Conventions: SI units; ``T_base_tool`` maps tool coordinates into base coordinates; a twist is
(v, ω), linear part first, in m/s and rad/s, of the named body in that body's own axes. All
instants are seconds on the rig's one ``Clock``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
GreyImage = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Frame:
    """One image and the instant it was true."""

    image: GreyImage  # (height, width), grey
    t_exposure_mid_s: float  # mid-exposure
    exposure_s: float
    seq: int  # counts exposures: a gap is a dropped frame
    stamp_source: str  # "sim", "kernel", "stream", "replay" or "host"


@dataclass(frozen=True, slots=True)
class ArmState:
    """One measured sample of the arm."""

    t_s: float  # the instant the sample was true
    T_base_tool: FloatArray  # (4, 4)
    twist_tool: FloatArray  # (6,) measured, in the tool's own axes
    # How uncertain ``t_s`` and ``twist_tool`` are, None where nobody knows.
    t_std_s: float | None = None  # standard deviation
    twist_covariance: FloatArray | None = None  # (6, 6)
    # Spectral density (6, 6) of the twist's error: how fast its integral loses its way. None:
    # errors of samples are independent, and it is the covariance times the time between samples.
    twist_spectrum: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Joints:
    """Where the joints are, where they may go, and how they move the tool; n joints."""

    names: tuple[str, ...]
    q: FloatArray  # (n,) m for slides, rad for rotations
    low: FloatArray  # (n,)
    high: FloatArray  # (n,)
    linear: tuple[bool, ...]  # whether each is a slide
    # Maps q (n,) to J (6, n): twist_tool = J q̇, in the tool's own axes.
    jacobian: Callable[[FloatArray], FloatArray]
    fastest: FloatArray | None = None  # (n,) m/s or rad/s at most, None where nobody knows


class Camera(Protocol):
    """A source of stamped grey images."""

    def read(self, timeout_s: float) -> Frame | None:
        """The newest frame not returned before, waiting up to ``timeout_s`` on the rig's clock.

        Returns None when no new frame became readable in time; with ``timeout_s=0`` it only
        looks. Raises OperateError when the device failed for good.
        """
        ...

    def close(self) -> None:
        """Release the device; harmless when repeated."""
        ...


class Arm(Protocol):
    """An arm that follows tool velocities and reports what it really does."""

    def read_states(self) -> list[ArmState]:
        """Every sample measured since the last call, oldest first; empty if there is none.

        Raises OperateError when the device failed or its newest sample is too old.
        """
        ...

    def command_twist(self, twist_tool: FloatArray, hold_s: float) -> None:
        """Follow ``twist_tool`` (6,) from now on; stop by itself ``hold_s`` after this call.

        Raises OperateError when the command cannot be delivered.
        """
        ...

    def tcp_offset(self) -> FloatArray | None:
        """The tool frame in the flange's (6,): x, y, z in m and a rotation vector in rad.

        None for an arm that does not keep one which somebody could change, or does not tell it.
        """
        ...

    def stop(self) -> None:
        """Decelerate to standstill as fast as the arm may; returns at once, can be repeated."""
        ...

    def close(self) -> None:
        """Stop and release the device; harmless when repeated."""
        ...


@runtime_checkable
class JointArm(Protocol):
    """What an arm that knows its joints offers besides ``Arm``."""

    def joints(self) -> Joints | None:
        """The joints at the newest sample; None before the first, or for an unknown model."""
        ...


@dataclass(frozen=True, slots=True)
class CommandDelay:
    """From a command to the motion it causes."""

    delay_s: float
    std_s: float
    measured: bool  # on this arm's own motion; else computed


@runtime_checkable
class DelayedArm(Protocol):
    """What an arm that follows commands noticeably late offers besides ``Arm``."""

    def command_delay(self) -> CommandDelay:
        """How late it follows, as far as it knows by now; raises OperateError when it failed."""
        ...


@runtime_checkable
class RemarkingArm(Protocol):
    """What an arm with reservations about itself offers besides ``Arm``."""

    def remarks(self) -> tuple[str, ...]:
        """What a person should know before it moves: what is not guarded, or only assumed."""
        ...
