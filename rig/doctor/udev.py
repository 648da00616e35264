"""udev rules: names that stay the same, and nodes for their group and whoever sits here."""

import re

from rig.doctor.node_tree import DeviceNode, Kind

RULES_FILE = "/etc/udev/rules.d/70-activerig.rules"
_GROUPS: dict[Kind, str] = {"video4linux": "video", "tty": "dialout"}
_FOLDER = "activerig"
_HEADER = f"""\
# Stable names and permissions for the devices of a rig, below /dev/{_FOLDER}.
# The number in the file's name must stay below 73, or uaccess is set too late. To activate:
#   sudo udevadm control --reload && sudo udevadm trigger
"""
_FTDI = """\
# FTDI adapters hold bytes back for 16 ms unless told otherwise.
ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"
"""
_NOTHING = """\
# Nothing that could be named is connected now: plug in the camera and the gantry, then write
# these rules again. Until then, all cameras and USB serial ports are given to their groups.
SUBSYSTEM=="video4linux", GROUP="video", MODE="0660", TAG+="uaccess"
SUBSYSTEM=="tty", KERNEL=="ttyUSB*|ttyACM*", GROUP="dialout", MODE="0660", TAG+="uaccess", \
ENV{ID_MM_DEVICE_IGNORE}="1"
"""


def rules_for(nodes: list[DeviceNode]) -> str:
    """The rules file for these nodes: one rule per device, named by vendor and serial number.

    A device without a serial number is named by its socket, which the comment says. Nothing is
    opened to everybody: the owner's group, and the user at the machine's own seat.
    """
    named = [node for node in nodes if node.usb is not None and node.index == 0]
    if not named:
        return "\n".join([_HEADER, _NOTHING, _FTDI])
    names = [stable_name(node) for node in named]
    rules = [_rule(node, names.count(name) > 1) for node, name in zip(named, names, strict=True)]
    return "\n".join([_HEADER, *dict.fromkeys(rules), _FTDI])


def stable_name(node: DeviceNode) -> str:
    """The node's name below /dev once the rules hold."""
    usb = node.usb
    assert usb is not None
    what = "camera" if node.kind == "video4linux" else "serial"
    own = usb.serial or f"socket-{usb.port}"
    return f"{_FOLDER}/{what}-{usb.vendor}-{usb.product}-" + re.sub(r"[^A-Za-z0-9.-]+", "_", own)


def _rule(node: DeviceNode, one_of_several: bool) -> str:
    usb = node.usb
    assert usb is not None
    # All ATTRS and KERNELS of one rule must match on one and the same device above the node.
    matches = [f'SUBSYSTEM=="{node.kind}"']
    if node.kind == "video4linux":
        matches.append('ATTR{index}=="0"')
    matches += [f'ATTRS{{idVendor}}=="{usb.vendor}"', f'ATTRS{{idProduct}}=="{usb.product}"']
    where = ""
    if usb.serial:
        matches.append(f'ATTRS{{serial}}=="{_pattern(usb.serial)}"')
    else:
        matches.append(f'KERNELS=="{_pattern(usb.port)}"')
        where = "; it has no serial number: the name belongs to the socket it is in"
    name = stable_name(node)
    if one_of_several:  # such as a camera with a colour and a depth picture
        matches.append(f'ENV{{ID_USB_INTERFACE_NUM}}=="{usb.interface}"')
        name += f"-if{usb.interface}"
    gives = [
        f'SYMLINK+="{name}"',
        f'GROUP="{_GROUPS[node.kind]}"',
        'MODE="0660"',
        'TAG+="uaccess"',
    ]
    if node.kind == "tty":
        gives.append('ENV{ID_MM_DEVICE_IGNORE}="1"')
    label = re.sub(r"\s+", " ", usb.name) or "unnamed device"
    return f"# {label}, now {node.path}{where}\n" + ", ".join(matches + gives) + "\n"


def _pattern(text: str) -> str:
    """``text`` as a pattern that matches it: what has a meaning in patterns matches any sign."""
    return re.sub(r'[*?\[\]|"\\\x00-\x1f]', "?", text)
