"""A capture device that fails exactly when a test says so, on whatever clock it is given."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from drivers.camera.device import CameraLost, ControlName, Grab, Mode
from drivers.clock import Clock
from drivers.errors import ConnectError
from drivers.interfaces import GreyImage

PERIOD_S = 1.0 / 30.0
TIMEOUT_S = 1.0
HEIGHT, WIDTH = 12, 16
MODE = Mode(WIDTH, HEIGHT, 30.0, "GREY")


def noise(n: int) -> GreyImage:
    return np.random.default_rng(n).integers(0, 255, (HEIGHT, WIDTH)).astype(np.uint8)


@dataclass
class Script:
    """What a camera does, as functions of time and of the exposure's number."""

    clock: Clock
    period_s: float = PERIOD_S
    transfer_s: float = 0.005  # from the stamp to the return of grab
    gone: Callable[[float], bool] = lambda t_s: False
    stalled: Callable[[float], bool] = lambda t_s: False
    dropped: Callable[[int], bool] = lambda n: False
    corrupt: Callable[[int], bool] = lambda n: False
    image: Callable[[int], GreyImage] = noise
    stamp: Callable[[float], float | None] = lambda t_s: t_s
    sequence: Callable[[int], int | None] = lambda n: None
    mode: Mode = MODE
    controls: dict[ControlName, int] = field(default_factory=dict)
    hold: Callable[[ControlName, int], int] = lambda name, value: value  # what a write leaves
    attempts: list[float] = field(default_factory=list)  # when it was tried to be opened
    opened: int = 0
    released: int = 0
    written: list[tuple[ControlName, int]] = field(default_factory=list)

    def open(self) -> "ScriptedDevice":
        self.attempts.append(self.clock.now_s())
        if self.gone(self.clock.now_s()):
            raise ConnectError("there is no such camera")
        self.opened += 1
        return ScriptedDevice(self)


class ScriptedControls:
    def __init__(self, script: Script) -> None:
        self._script = script

    def read(self, name: ControlName) -> int | None:
        return self._script.controls.get(name)

    def write(self, name: ControlName, value: int) -> str | None:
        self._script.written.append((name, value))
        if name not in self._script.controls:
            return "this camera does not have it"
        self._script.controls[name] = self._script.hold(name, value)
        return None


class ScriptedDevice:
    stamp_source = "kernel"
    stamps_mid_exposure = False

    def __init__(self, script: Script) -> None:
        self._script = script
        self._last = math.floor(script.clock.now_s() / script.period_s + 1e-9)
        self._first = self._last + 1
        self.controls = ScriptedControls(script)

    def set_mode(self, mode: Mode, buffers: int) -> Mode:
        return self._script.mode

    def grab(self) -> Grab:
        """The next exposure after now; exposures nobody waits for are lost, as without buffers."""
        script, clock = self._script, self._script.clock
        now_s = clock.now_s()
        if script.gone(now_s):
            raise CameraLost("unplugged")
        n = max(self._last + 1, math.floor((now_s - script.transfer_s) / script.period_s) + 1)
        while script.dropped(n) or script.stalled(n * script.period_s):
            n += 1
            if n * script.period_s > now_s + TIMEOUT_S:
                clock.sleep_until(now_s + TIMEOUT_S)
                raise CameraLost(f"stalled: no frame for {TIMEOUT_S:.0f} s")
        self._last = n
        t_s = n * script.period_s
        clock.sleep_until(t_s + script.transfer_s)
        if script.gone(clock.now_s()):
            raise CameraLost("unplugged")
        return Grab(
            image=None if script.corrupt(n) else script.image(n),
            returned_s=clock.now_s(),
            stamp_s=script.stamp(t_s),
            sequence=script.sequence(n - self._first),
        )

    def release(self) -> None:
        self._script.released += 1
