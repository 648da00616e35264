"""Faults on demand: what can go wrong with a gantry, by name."""

from collections.abc import Callable

from sim_backend.loopback_grbl.firmware import Firmware

# name -> (what it does, what ends it)
_FAULTS: dict[str, tuple[Callable[[Firmware], None], Callable[[Firmware], None]]] = {}


def fault_names() -> tuple[str, ...]:
    """The faults that the controller itself can have; a dropped line is the server's."""
    return tuple(_FAULTS)


def inject(firmware: Firmware, name: str) -> None:
    """Begin a fault; raises KeyError, naming the known ones, for an unknown one."""
    _known(name)[0](firmware)


def clear(firmware: Firmware, name: str) -> None:
    """End a fault's cause; what it did to the controller stays until the host recovers it."""
    _known(name)[1](firmware)


def _known(name: str) -> tuple[Callable[[Firmware], None], Callable[[Firmware], None]]:
    if name not in _FAULTS:
        raise KeyError(f"no fault {name!r}; known: {', '.join(_FAULTS)}")
    return _FAULTS[name]


def _nothing(_: Firmware) -> None:
    """Causes that end by themselves."""


def _alarm(firmware: Firmware) -> None:
    firmware.states.hard_limit()


def _open_door(firmware: Firmware) -> None:
    firmware.states.pressed += "D"
    firmware.states.open_door()


def _close_door(firmware: Firmware) -> None:
    firmware.states.pressed = firmware.states.pressed.replace("D", "")


def _press_emergency(firmware: Firmware) -> None:
    firmware.states.emergency_stop()


def _release_emergency(firmware: Firmware) -> None:
    firmware.states.pressed = firmware.states.pressed.replace("E", "")


def _hold(firmware: Firmware) -> None:
    firmware.act("hold")


def _reset(firmware: Firmware) -> None:
    firmware.act("reset")


def _stall(firmware: Firmware) -> None:
    firmware.stalled = True


def _unstall(firmware: Firmware) -> None:
    firmware.stalled = False


_FAULTS |= {
    "alarm": (_alarm, _nothing),
    "door": (_open_door, _close_door),
    "hold": (_hold, _nothing),
    "emergency_stop": (_press_emergency, _release_emergency),
    "reset": (_reset, _nothing),
    "stall": (_stall, _unstall),
}
