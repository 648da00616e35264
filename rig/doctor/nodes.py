"""Which cameras and serial ports are connected, and whether this user may use them."""

import getpass
import grp
from pathlib import Path

from drivers.clock import Clock
from rig.doctor.finding import Finding, Status
from rig.doctor.node_tree import DeviceNode, find_nodes
from rig.doctor.subject import Subject
from rig.doctor.system import read_text

_RULES = (
    "rig doctor --write-udev - | sudo tee /etc/udev/rules.d/70-activerig.rules && "
    "sudo udevadm control --reload && sudo udevadm trigger"
)
_OTHERS_WRITE = 0o002
_SLOW_TIMER_MS = 2


def video_nodes(subject: Subject, clock: Clock) -> Finding:
    """The nodes of cameras."""
    return judge_nodes("video_nodes", "camera", find_nodes("video4linux", subject.root))


def serial_nodes(subject: Subject, clock: Clock) -> Finding:
    """The nodes of USB serial ports."""
    found = find_nodes("tty", subject.root)
    return judge_nodes("serial_nodes", "USB serial port", found, modem_manager_runs(subject.root))


def judge_nodes(
    name: str, what: str, nodes: list[DeviceNode], modem_manager: bool = False
) -> Finding:
    """Nothing connected is fine; a node that this user may not use, or everybody may, is not.

    A warning only: whether the rig needs that node, the camera's and the arm's rows say.
    """
    values = {node.path: f"{node.mode:03o} {node.group}" for node in nodes}
    if not nodes:
        return Finding(name, Status.OK, f"no {what} is connected", "", {})
    text = ", ".join(_words(node) for node in nodes)
    for advice in _complaints(nodes, modem_manager):
        return Finding(name, Status.WARN, text, advice, values)
    return Finding(name, Status.OK, text, "", values)


def _complaints(nodes: list[DeviceNode], modem_manager: bool) -> list[str]:
    """What to type against what is wrong, the gravest first."""
    out: list[str] = []
    closed = [node for node in nodes if not node.accessible]
    if closed:
        out.append(permission_advice(closed[0]))
    if any(node.mode & _OTHERS_WRITE for node in nodes):
        out.append(f"everybody may write it; give it to its group: {_RULES}")
    if any((node.latency_timer_ms or 0) > _SLOW_TIMER_MS for node in nodes):
        out.append(f"the adapter holds bytes back; the rules change that: {_RULES}")
    if modem_manager:
        out.append(f"ModemManager talks to new serial ports; the rules keep it away: {_RULES}")
    return out


def permission_advice(node: DeviceNode) -> str:
    """How to get at a node that this process may not use."""
    if node.group in ("root", "0") or not node.mode & 0o060:
        return f"{node.path} belongs to root alone: {_RULES}"
    if _is_member(node.group):
        return f"you are in group {node.group}, but logged in before that: log out and in again"
    return f'sudo usermod -aG {node.group} "$USER", then log out and in again'


def modem_manager_runs(root: Path) -> bool:
    """Whether ModemManager, which sends modem commands to new serial ports, is running."""
    return any(read_text(path) == "ModemManager" for path in root.glob("proc/[0-9]*/comm"))


def _is_member(group: str) -> bool:
    try:
        return getpass.getuser() in grp.getgrnam(group).gr_mem
    except (KeyError, OSError):
        return False


def _words(node: DeviceNode) -> str:
    about = [f"{node.group} {node.mode:03o}"]
    if node.usb is not None and node.usb.name:
        about.insert(0, node.usb.name)
    if not node.accessible:
        about.append("no permission")
    if node.latency_timer_ms is not None:
        about.append(f"latency timer {node.latency_timer_ms} ms")
    return f"{node.path} ({', '.join(about)})"
