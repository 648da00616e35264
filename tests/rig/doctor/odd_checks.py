"""Checks that behave in every way a check can: for the runner's tests."""

import os
import sys
import tempfile
import time
from pathlib import Path

from drivers.clock import Clock
from drivers.errors import ConnectError
from rig.doctor.finding import Finding, Status
from rig.doctor.subject import Subject


def fine(subject: Subject, clock: Clock) -> Finding:
    """Prints as libraries do, and is content."""
    print("something on standard output")
    print("something on standard error", file=sys.stderr)
    return Finding("fine", Status.OK, subject.config.name, "", {"pid": os.getpid()})


def not_a_number(subject: Subject, clock: Clock) -> Finding:
    """Measured nothing."""
    return Finding("not_a_number", Status.WARN, "–", "try again", {"rate_hz": float("nan")})


def device_error(subject: Subject, clock: Clock) -> Finding:
    """A device that cannot be had."""
    raise ConnectError("nobody answers at 192.0.2.1: check the cable")


def defect(subject: Subject, clock: Clock) -> Finding:
    """A mistake in the check."""
    raise ZeroDivisionError("division by zero")


def crash(subject: Subject, clock: Clock) -> Finding:
    """A library that takes the process down."""
    print("libvendor: assertion failed", file=sys.stderr, flush=True)
    os.abort()


def leave(subject: Subject, clock: Clock) -> Finding:
    """A library that ends the process."""
    os._exit(7)


def hang(subject: Subject, clock: Clock) -> Finding:
    """A device that never answers; leaves a file behind, and one where runs go to be seen."""
    if subject.runs.parent.is_dir():
        subject.runs.touch()
    Path(tempfile.mkdtemp(), "left").touch()
    time.sleep(600.0)
    raise AssertionError("nobody waits so long")
