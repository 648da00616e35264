"""The dashboard: one line in, one line out; the texts are those of the dashboard server's guide.

A CB3 has no remote-control mode and does not understand being asked for it.
"""

from collections.abc import Callable

from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.safety import RobotMode, RuntimeState, SafetyMode

BANNER = "Connected: Universal Robots Dashboard Server"

_RUNTIME_WORDS = {
    RuntimeState.STOPPED: "STOPPED",
    RuntimeState.PLAYING: "PLAYING",
    RuntimeState.PAUSED: "PAUSED",
}


_UNLOCK_REFUSED = (
    "Cannot unlock protective stop until 5s after occurrence. "
    "Always inspect cause of protective stop before unlocking"
)

# Commands that only acknowledge: there is no pop-up and no safety controller to restart here.
_ACKNOWLEDGED = {
    "close safety popup": "closing safety popup",
    "close popup": "closing popup",
    "restart safety": "Restarting safety",
    "get loaded program": "No program loaded",
    "get robot model": "UR5",
    "quit": "Disconnected",
}


class Dashboard:
    """Answers for one controller."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._actions: dict[str, Callable[[], str]] = {
            "polyscopeversion": self._version,
            "get serial number": lambda: controller.config.serial_number,
            "robotmode": lambda: f"Robotmode: {controller.robot_mode.name}",
            "safetymode": lambda: f"Safetymode: {controller.safety_mode.name}",
            "safetystatus": lambda: f"Safetystatus: {controller.safety_mode.name}",
            "programstate": lambda: f"{_RUNTIME_WORDS[controller.runtime]} rtde_control.urp",
            "running": lambda: f"Program running: {self._running()}",
            "stop": self._stop,
            "pause": lambda: "Pausing program" if controller.pause() else _failed("pause"),
            "play": lambda: "Starting program" if controller.play() else _failed("play"),
            "unlock protective stop": self._unlock,
            **({} if controller.config.is_cb3 else {"is in remote control": lambda: "true"}),
            "power on": lambda: self._power(RobotMode.IDLE, "Powering on"),
            "brake release": lambda: self._power(RobotMode.RUNNING, "Brake releasing"),
            "power off": lambda: self._power(RobotMode.POWER_OFF, "Powering off"),
        }

    def answer(self, line: str) -> str:
        """The reply to one command line, without its newline; the command is carried out."""
        words = line.strip()
        command = words.lower()
        if command in self._actions:
            return self._actions[command]()
        return _ACKNOWLEDGED.get(command, f"could not understand: '{words}'")

    def _version(self) -> str:
        version = ".".join(str(part) for part in self._controller.config.version)
        return f"URSoftware {version} (Jan 15 2024)"

    def _running(self) -> str:
        return str(self._controller.runtime is RuntimeState.PLAYING).lower()

    def _stop(self) -> str:
        self._controller.stop_program()
        return "Stopped"

    def _unlock(self) -> str:
        released = self._controller.unlock_protective_stop()
        return "Protective stop releasing" if released else _UNLOCK_REFUSED

    def _power(self, mode: RobotMode, reply: str) -> str:
        """Assumed: power changes are instant; a stopped safety system keeps the power off."""
        controller = self._controller
        if controller.safety_mode is SafetyMode.NORMAL:
            if mode is RobotMode.POWER_OFF:
                controller.stop_program()
            if not (mode is RobotMode.IDLE and controller.robot_mode is RobotMode.RUNNING):
                controller.robot_mode = mode
        return reply


def _failed(command: str) -> str:
    return f"Failed to execute: {command}"
