"""``rig calibrate`` in this process on a simulated rig that is cheap to look through."""

import signal
from collections.abc import Callable
from typing import Any

import pytest

from tests.rig.command_line import Outcome, rig

SMALL = (
    "calibration.plan.poses=10",
    "calibration.plan.verify_poses=2",
    "calibration.plan.segment_s=3",
    "calibration.plan.hand_eye.bootstrap=50",
    "sim.renderer=raster",
    "sim.camera.width=320",
    "sim.camera.height=240",
    "sim.camera.focal_px=400",
    "calibration.intrinsics.fx_px=400",
    "calibration.intrinsics.fy_px=400",
    "calibration.intrinsics.cx_px=159.5",
    "calibration.intrinsics.cy_px=119.5",
)


def calibrate(*arguments: str, settings: tuple[str, ...] = ()) -> Outcome:
    return rig("calibrate", *arguments, *(f"--set={one}" for one in (*SMALL, *settings)))


def at_call(
    monkeypatch: pytest.MonkeyPatch,
    owner: Any,
    name: str,
    number: int,
    act: Callable[[], object],
    then: bool = True,
) -> list[int]:
    """Make call ``number`` (from 1) of ``owner.name`` also ``act`` first; the count of calls.

    Unless ``then``, ``act`` takes the place of the call.
    """
    original, calls = getattr(owner, name), [0]

    def wrapped(*given: Any, **named: Any) -> Any:
        calls[0] += 1
        if calls[0] == number:
            result = act()
            if not then:
                return result
        return original(*given, **named)

    monkeypatch.setattr(owner, name, wrapped)
    return calls


def ctrl_c() -> None:
    """What a terminal does at Ctrl-C."""
    signal.raise_signal(signal.SIGINT)


def failing(error: Exception) -> Callable[[], object]:
    """Something that raises ``error``."""

    def act() -> object:
        raise error

    return act
