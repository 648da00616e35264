"""Device nodes and the rules for them, on trees made up like /dev and /sys."""

import os
from dataclasses import replace
from pathlib import Path

import pytest

from rig.doctor.finding import Status
from rig.doctor.node_tree import DeviceNode, UsbIdentity, find_nodes
from rig.doctor.nodes import judge_nodes, modem_manager_runs, permission_advice
from rig.doctor.udev import rules_for, stable_name

CAMERA = UsbIdentity("046d", "0825", "ABC123", "1-1", "HD Webcam", "00")
BOARD = UsbIdentity("0403", "6001", "A50285BI", "1-2.3", "FT232R USB UART", "00")


def node(path: str = "/dev/video0", usb: UsbIdentity | None = CAMERA, **changes) -> DeviceNode:
    kind = "video4linux" if "video" in path else "tty"
    whole = DeviceNode(path, kind, "video", 0o660, True, (), 0, usb, None)
    return replace(whole, **changes)


def plug(root: Path, kind: str, name: str, usb: UsbIdentity, **files: str) -> None:
    """A device as the kernel shows it: a node, a class entry, and the USB device above."""
    device = root / "sys/devices/pci0000:00/usb1" / usb.port
    interface = device / f"{usb.port}:1.{int(usb.interface, 16)}"
    entry = interface / kind / name
    entry.mkdir(parents=True)
    (entry / "device").symlink_to(interface)
    (root / "sys/class" / kind).mkdir(parents=True, exist_ok=True)
    (root / "sys/class" / kind / name).symlink_to(entry)
    (interface / "bInterfaceNumber").write_text(usb.interface + "\n")
    about = {"idVendor": usb.vendor, "idProduct": usb.product, "product": usb.name}
    about |= {"serial": usb.serial} if usb.serial else {}
    for file, text in about.items():
        (device / file).write_text(text + "\n")
    for file, text in files.items():
        (entry / file if file == "index" else interface / file).write_text(text + "\n")
    (root / "dev").mkdir(exist_ok=True)
    (root / "dev" / name).touch(mode=0o660)
    (root / "dev" / name).chmod(0o660)


def test_nodes_are_found_with_what_their_usb_device_says(tmp_path):
    plug(tmp_path, "video4linux", "video10", CAMERA, index="1")
    plug(tmp_path, "video4linux", "video2", replace(CAMERA, port="1-4", serial=""), index="0")
    plug(tmp_path, "tty", "ttyUSB0", BOARD, latency_timer="16")
    (tmp_path / "dev/tty0").touch()
    (tmp_path / "dev/v4l/by-id").mkdir(parents=True)
    (tmp_path / "dev/v4l/by-id/usb-cam-index0").symlink_to("../../video2")
    second, tenth = find_nodes("video4linux", tmp_path)
    assert (second.path, tenth.path) == ("/dev/video2", "/dev/video10")
    assert (second.index, tenth.index) == (0, 1)
    assert second.stable_names == ("/dev/v4l/by-id/usb-cam-index0",)
    assert (second.usb, tenth.usb) == (replace(CAMERA, port="1-4", serial=""), CAMERA)
    (port,) = find_nodes("tty", tmp_path)
    assert (port.path, port.usb, port.latency_timer_ms) == ("/dev/ttyUSB0", BOARD, 16)
    assert port.mode == 0o660


def test_a_node_without_sysfs_is_found_too_and_a_machine_without_dev_has_none(tmp_path):
    assert find_nodes("tty", tmp_path / "nothing") == []
    (tmp_path / "dev").mkdir()
    (tmp_path / "dev/ttyACM3").touch()
    (tmp_path / "dev/ttyACM4").symlink_to("gone")
    (port,) = find_nodes("tty", tmp_path, accessible=lambda path: False)
    assert (port.path, port.usb, port.accessible) == ("/dev/ttyACM3", None, False)


@pytest.mark.parametrize(
    ("nodes", "status", "advice"),
    [
        ([], Status.OK, ""),
        ([node()], Status.OK, ""),
        ([node(), node(accessible=False, group="nobodys")], Status.WARN, "usermod -aG nobodys"),
        ([node(accessible=False, group="root", mode=0o600)], Status.WARN, "--write-udev"),
        ([node(mode=0o666)], Status.WARN, "everybody"),
        ([node("/dev/ttyUSB0", BOARD, latency_timer_ms=16)], Status.WARN, "holds bytes back"),
        ([node("/dev/ttyUSB0", BOARD, latency_timer_ms=1)], Status.OK, ""),
    ],
)
def test_a_node_is_for_its_group_and_this_user_is_in_it(nodes, status, advice):
    finding = judge_nodes("nodes", "camera", nodes)
    assert finding.status is status
    assert advice in finding.advice and bool(finding.advice) is bool(advice)


def test_modem_manager_is_named_where_there_is_a_port_for_it(tmp_path):
    (tmp_path / "proc/12").mkdir(parents=True)
    (tmp_path / "proc/12/comm").write_text("ModemManager\n")
    assert modem_manager_runs(tmp_path)
    ports = [node("/dev/ttyACM0", BOARD)]
    assert "ModemManager" in judge_nodes("serial", "port", ports, modem_manager=True).advice
    assert judge_nodes("serial", "port", [], modem_manager=True).status is Status.OK


def test_who_is_already_in_the_group_is_told_to_log_in_again(monkeypatch):
    monkeypatch.setattr("rig.doctor.nodes._is_member", lambda group: True)
    advice = permission_advice(node(accessible=False))
    assert "log out and in again" in advice and "usermod" not in advice


def test_rules_name_devices_by_vendor_and_serial_number_and_open_nothing_to_everybody():
    rules = rules_for([node(), node("/dev/ttyUSB0", BOARD, group="dialout")])
    lines = [line for line in rules.splitlines() if line and not line.startswith("#")]
    camera, board, timer = lines
    assert 'ATTRS{idVendor}=="046d", ATTRS{idProduct}=="0825", ATTRS{serial}=="ABC123"' in camera
    assert 'ATTR{index}=="0"' in camera and 'SYMLINK+="activerig/camera-046d-0825-ABC123"' in camera
    assert 'SYMLINK+="activerig/serial-0403-6001-A50285BI"' in board
    assert 'ENV{ID_MM_DEVICE_IGNORE}="1"' in board and "latency_timer" in timer
    for line in (camera, board):
        assert 'GROUP="' in line and 'MODE="0660"' in line and 'TAG+="uaccess"' in line
    assert "0666" not in rules and "0777" not in rules


def test_a_device_without_a_serial_number_is_named_by_its_socket():
    nameless = replace(CAMERA, serial="", port="1-1.2")
    rules = rules_for([node(usb=nameless)])
    assert 'KERNELS=="1-1.2"' in rules and "ATTRS{serial}" not in rules
    assert "the name belongs to the socket" in rules
    assert stable_name(node(usb=nameless)).endswith("socket-1-1.2")


def test_several_pictures_of_one_camera_have_names_of_their_own():
    depth, colour = node(), node("/dev/video4", replace(CAMERA, interface="03"))
    metadata = node("/dev/video1", index=1)
    rules = rules_for([depth, metadata, colour])
    assert rules.count("SYMLINK+=") == 2
    assert 'ENV{ID_USB_INTERFACE_NUM}=="03"' in rules and "ABC123-if03" in rules


@pytest.mark.parametrize("serial", ['a"b', "x*y[1]?|z", "with space", "ü", "back\\slash"])
def test_no_serial_number_breaks_out_of_its_rule(serial):
    rules = rules_for([node(usb=replace(CAMERA, serial=serial))])
    (rule,) = [line for line in rules.splitlines() if "SYMLINK" in line]
    assert rule.count('"') % 2 == 0
    assert all(part.count('"') == 2 for part in rule.split(", ")), rule
    name = rule.partition('SYMLINK+="')[2].partition('"')[0]
    assert name.startswith("activerig/") and name.isascii() and " " not in name


def test_with_nothing_connected_the_rules_serve_whole_groups():
    for nodes in ([], [node(usb=None)]):
        rules = rules_for(nodes)
        assert 'SUBSYSTEM=="video4linux", GROUP="video", MODE="0660"' in rules
        assert "0666" not in rules


def test_permissions_are_those_of_the_process(tmp_path):
    (tmp_path / "dev").mkdir()
    (tmp_path / "dev/video0").touch()
    (found,) = find_nodes("video4linux", tmp_path)
    assert found.accessible is os.access(tmp_path / "dev/video0", os.R_OK | os.W_OK)
