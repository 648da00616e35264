"""The checks, in the order of the report; each is imported when its turn comes."""

from collections.abc import Callable
from dataclasses import dataclass

from rig.doctor.subject import Subject


def _always(subject: Subject) -> bool:
    return True


def _hardware(subject: Subject) -> bool:
    return subject.hardware


def _simulated(subject: Subject) -> bool:
    return not subject.hardware


def _networked(subject: Subject) -> bool:
    return subject.config.arm.driver == "ur"


@dataclass(frozen=True, slots=True)
class Check:
    """One check: where its function is, and when it counts as hanging."""

    name: str
    entry: str  # "module:function"
    limit_s: float
    applies: Callable[[Subject], bool] = _always


# Limits leave room for a machine under load, and for compiling the kernels on their first use.
CHECKS = (
    Check("kernel", "rig.doctor.system:kernel", 10.0),
    Check("realtime_priority", "rig.doctor.system:realtime_priority", 10.0),
    Check("memory", "rig.doctor.system:memory", 10.0),
    Check("processor", "rig.doctor.system:processor", 10.0),
    Check("packages", "rig.doctor.packages:packages", 30.0),
    Check("renderer", "rig.doctor.simulation:renderer", 30.0),
    Check("disk", "rig.doctor.disk:disk", 40.0),
    Check("video_nodes", "rig.doctor.nodes:video_nodes", 10.0),
    Check("serial_nodes", "rig.doctor.nodes:serial_nodes", 10.0),
    Check("image_kernels", "rig.doctor.simulation:image_kernels", 600.0),
    Check("simulated_rig", "rig.doctor.simulation:simulated_rig", 120.0, _simulated),
    Check("calibration", "rig.doctor.devices:calibration", 10.0, _hardware),
    Check("camera", "rig.doctor.devices:camera", 60.0, _hardware),
    Check("arm", "rig.doctor.devices:arm", 40.0, _hardware),
    Check("arm_link", "rig.doctor.link:arm_link", 40.0, _networked),
    Check("loop_idle", "rig.doctor.lateness:idle", 40.0),
    Check("loop_vision", "rig.doctor.lateness:with_vision", 300.0),
)


def checks_for(subject: Subject) -> list[Check]:
    """The checks that apply to ``subject``."""
    return [check for check in CHECKS if check.applies(subject)]
