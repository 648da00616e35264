"""The controller's numbers in words."""

_ERRORS = {
    1: "a word does not begin with a letter",
    2: "a number is malformed",
    3: "the $ command is not known",
    5: "homing is switched off ($22=0)",
    8: "only possible when idle",
    9: "locked by an alarm, or a jog is under way",
    11: "the line is too long",
    15: "the jog leads beyond the controller's soft limits ($130...)",
    16: "malformed jog",
    20: "unknown or unsupported word",
    22: "no feed rate",
    33: "invalid target",
    79: "the controller must be reset first",
}

_ALARMS = {
    1: "a limit switch was hit; the position may be lost, home again",
    2: "a move led beyond the soft limits",
    3: "reset while moving; the position may be lost, home again",
    6: "homing failed: it was reset",
    7: "homing failed: the door opened",
    8: "homing failed: the switch did not open again",
    9: "homing failed: no switch was found",
    10: "emergency stop pressed; release it, then recover",
    11: "homing is required before anything moves",
    12: "a limit switch is still pressed",
    14: "a spindle fault",
    17: "a motor driver reports a fault",
}

_DOORS = {
    0: "the safety door is closed again, waiting to go on",
    1: "the safety door is open",
    2: "the safety door opened, coming to rest",
    3: "the safety door closed, going on",
}

_PINS = {
    "X": "limit switch X",
    "Y": "limit switch Y",
    "Z": "limit switch Z",
    "A": "limit switch A",
    "B": "limit switch B",
    "C": "limit switch C",
    "D": "door",
    "E": "emergency stop",
    "H": "feed hold",
    "R": "reset",
    "S": "cycle start",
    "M": "motor fault",
}


def error_words(code: int) -> str:
    """``error:15 (the jog leads ...)``."""
    return f"error:{code} ({_ERRORS.get(code, 'see the list of Grbl error codes')})"


def alarm_words(code: int | None) -> str:
    """``ALARM:1 (a limit switch ...)``; without a code: locked since power-up."""
    if code is None:
        return "alarm (locked since power-up or a reset; home it, or unlock it)"
    return f"ALARM:{code} ({_ALARMS.get(code, 'see the list of Grbl alarm codes')})"


def door_words(part: int | None) -> str:
    """The phases of the Door state."""
    return _DOORS.get(1 if part is None else part, "the safety door is open")


def pin_words(pins: str) -> str:
    """The active inputs, in words; empty when there are none."""
    return ", ".join(_PINS.get(pin, pin) for pin in pins)
