"""From a stopped arm to one that may move again; a person decides, this only explains and asks."""

from collections.abc import Callable

from drivers.clock import Clock
from drivers.errors import OperateError
from drivers.ur.dashboard import Dashboard

_RETRY_S = 0.25
_UNLOCK_TIMEOUT_S = 10.0  # the controller refuses in the first 5 s after the stop
_POWER_TIMEOUT_S = 60.0

_EXPLAINED = {
    "NORMAL": "the safety system is normal",
    "REDUCED": "the safety system is in reduced mode",
    "PROTECTIVE_STOP": "the arm is in a protective stop: it hit something, came to a limit, or "
    "was asked for more than it can do. Look at it and clear its way before going on",
    "RECOVERY": "the arm is outside its safety limits (recovery mode)",
    "SAFEGUARD_STOP": "a safeguard (door, light curtain) is open",
    "SYSTEM_EMERGENCY_STOP": "an emergency stop of the cell is pressed",
    "ROBOT_EMERGENCY_STOP": "an emergency stop button of the arm is pressed",
    "VIOLATION": "a safety limit was violated",
    "FAULT": "the safety system has a fault",
}
_HUMAN_FIRST = {
    "RECOVERY": "jog it back inside with the pendant, then recover again",
    "SAFEGUARD_STOP": "close it, then recover again",
    "SYSTEM_EMERGENCY_STOP": "release it when it is safe, then recover again",
    "ROBOT_EMERGENCY_STOP": "release it when it is safe, then recover again",
}
_RESTART_SAFETY = ("VIOLATION", "FAULT")


def recover_controller(host: str, clock: Clock, confirm: Callable[[str], bool]) -> None:
    """Unlock, power and release the arm at ``host`` until a program could be started.

    Any program that is still loaded or paused is stopped first, so that no old motion resumes.
    Raises OperateError when a person has to act first, or declined; ConnectError when the
    controller cannot be reached.
    """
    with Dashboard(host) as dashboard:
        safety = dashboard.value("safetystatus").upper()
        robot = dashboard.value("robotmode").upper()
        explained = _EXPLAINED.get(safety, f"the safety status is {safety}")
        if safety in _HUMAN_FIRST:
            raise OperateError(f"{host}: {explained}; {_HUMAN_FIRST[safety]}")
        question = f"{host}: {explained}; the arm's mode is {robot.lower().replace('_', ' ')}."
        if not confirm(question):
            raise OperateError(f"{host}: not recovered, as you decided; nothing was unlocked")
        dashboard.ask("stop")
        dashboard.ask("close safety popup")
        if safety == "PROTECTIVE_STOP":
            _unlock(dashboard, host, clock)
        elif safety in _RESTART_SAFETY:
            dashboard.ask("restart safety")
        _power_up(dashboard, host, clock)


def stop_controller(host: str, timeout_s: float = 5.0) -> str:
    """Stop whatever program runs on the controller; its reply. Raises ConnectError."""
    with Dashboard(host, timeout_s) as dashboard:
        return dashboard.ask("stop")


def _unlock(dashboard: Dashboard, host: str, clock: Clock) -> None:
    reply = ""

    def released() -> bool:
        nonlocal reply
        if dashboard.value("safetystatus").upper() not in ("NORMAL", "REDUCED"):
            reply = dashboard.ask("unlock protective stop")
            return False
        return True

    if not _wait(clock, _UNLOCK_TIMEOUT_S, released):
        raise OperateError(f"{host}: the protective stop cannot be unlocked: {reply}")


def _power_up(dashboard: Dashboard, host: str, clock: Clock) -> None:
    mode = ""

    def running() -> bool:
        nonlocal mode
        mode = dashboard.value("robotmode").upper()
        if mode == "POWER_OFF":
            dashboard.ask("power on")
        elif mode == "IDLE":
            dashboard.ask("brake release")
        return mode == "RUNNING"

    if not _wait(clock, _POWER_TIMEOUT_S, running):
        raise OperateError(f"{host}: the arm stays in mode {mode.lower()!r}: look at the pendant")


def _wait(clock: Clock, timeout_s: float, done: Callable[[], bool]) -> bool:
    deadline_s = clock.now_s() + timeout_s
    while not done():
        if clock.now_s() > deadline_s:
            return False
        clock.sleep_until(clock.now_s() + _RETRY_S)
    return True
