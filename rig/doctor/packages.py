"""The packages that only some rigs need."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version

from drivers.camera.source import SourceKind, parse_source
from drivers.clock import Clock
from drivers.errors import ConfigError
from rig.config import RigConfig
from rig.doctor.finding import Finding, Status
from rig.doctor.subject import Subject


@dataclass(frozen=True, slots=True)
class Extra:
    """A package, and what it is for."""

    distribution: str
    module: str
    requirement: str
    purpose: str


EXTRAS = (
    Extra("pyserial", "serial", "pyserial>=3.5,<4", "serial gantries"),
    Extra("ur-rtde", "rtde_control", "ur-rtde>=1.6.1,<2", "Universal Robots arms"),
    Extra("linuxpy", "linuxpy.video.device", "linuxpy>=0.25,<1", "frame counters of V4L2 cameras"),
)
_OPTIONAL = ("linuxpy",)


def packages(subject: Subject, clock: Clock) -> Finding:
    """Which of them can be imported here, and whether the rig needs the others."""
    return judge_packages({e.distribution: state_of(e) for e in EXTRAS}, needed_by(subject.config))


def state_of(
    extra: Extra,
    load: Callable[[str], object] = import_module,
    version_of: Callable[[str], str] = version,
) -> str | None:
    """The version of a package that can be imported, None for one that is not there.

    One that is there and cannot be imported says why, after an exclamation mark.
    """
    try:
        found = version_of(extra.distribution)
    except PackageNotFoundError:
        return None
    try:
        load(extra.module)
    except (ImportError, OSError, RuntimeError) as error:
        return f"!{error}"
    return found


def needed_by(config: RigConfig) -> set[str]:
    """The distributions that the rig's drivers use."""
    needed: set[str] = set()
    if config.arm.driver == "ur":
        needed.add("ur-rtde")
    if config.arm.driver == "grbl":
        needed.add("pyserial")
    if config.camera.driver == "opencv":
        try:
            kind = parse_source(config.camera.source).kind
        except ConfigError:
            return needed  # the camera's own row says what is wrong with it
        if kind is SourceKind.DEVICE and config.camera.access != "opencv":
            needed.add("linuxpy")
    return needed


def judge_packages(states: dict[str, str | None], needed: set[str]) -> Finding:
    """Missing is bad only where it is needed, and a warning where the rig does without."""
    status, parts, wanted = Status.OK, [], []
    for extra in EXTRAS:
        name = extra.distribution
        state = states.get(name)
        if state is not None and not state.startswith("!"):
            parts.append(f"{name} {state}")
            continue
        broken = "" if state is None else f" broken ({state[1:]})"
        parts.append(f"{name}{broken or ' not installed'}")
        if name in needed:
            status = Status.WARN if name in _OPTIONAL and status is Status.OK else Status.FAIL
            wanted.append(extra)
        elif broken:
            status = Status.WARN if status is Status.OK else status
            wanted.append(extra)
    if wanted:
        quoted = " ".join(f"'{extra.requirement}'" for extra in wanted)
        why = ", ".join(extra.purpose for extra in wanted)
        advice = f"{sys.executable} -m pip install {quoted} ({why})"
        if any(e.distribution == "ur-rtde" for e in wanted) and sys.version_info >= (3, 13):
            advice += "; it has wheels for Python 3.11 and 3.12 only: use one of these"
    else:
        advice = ""
    return Finding("packages", status, ", ".join(parts), advice, dict(states))
