"""The process that runs checks one after another and reports each on a pipe.

Standard input carries the request (one line of JSON) and then nothing: its end means that the
parent is gone, and the worker and whatever it started end with it.
"""

import json
import os
import signal
import sys
import threading
from collections.abc import Callable
from importlib import import_module
from typing import Any, BinaryIO, cast

from drivers.clock import Clock, WallClock
from drivers.errors import RigError
from rig.doctor.finding import Finding, Status
from rig.doctor.subject import Subject, subject_of

Examine = Callable[[Subject, Clock], Finding]

_LOOK = "see what it says"


def examine(name: str, entry: str, subject: Subject) -> Finding:
    """Run the check that ``entry``, "module:function", names; what it raises becomes its row."""
    module, _, function = entry.partition(":")
    try:
        check = cast(Examine, getattr(import_module(module), function))
        return check(subject, WallClock())
    except RigError as error:
        what, _, advice = str(error).rpartition(": ")
        return Finding(name, Status.FAIL, what or advice, advice if what else _LOOK)
    except Exception as error:  # noqa: BLE001 -- one check's fault must not hide the others
        return Finding(
            name,
            Status.FAIL,
            f"the check itself failed: {type(error).__name__}: {error}",
            "report this with the whole line",
        )


def main() -> None:
    """Argument: the number of the pipe to report on."""
    out: BinaryIO = os.fdopen(int(sys.argv[1]), "wb", buffering=0)
    request = json.loads(sys.stdin.buffer.readline())
    threading.Thread(target=_end_with_parent, name="parent", daemon=True).start()
    subject = subject_of(request["subject"])
    for name, entry in request["checks"]:
        _say(out, {"begin": name})
        _say(out, {"finding": examine(name, entry, subject).as_json()})


def _say(out: BinaryIO, message: dict[str, Any]) -> None:
    out.write(json.dumps(message).encode() + b"\n")


def _end_with_parent() -> None:
    sys.stdin.buffer.read()
    os.killpg(os.getpgrp(), signal.SIGKILL)


def run() -> None:
    """The process's whole life."""
    main()
    # Not through the interpreter's end: a driver's thread that hangs must not hold it up.
    os._exit(0)
