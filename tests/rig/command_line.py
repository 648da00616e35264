"""The ``rig`` command in this process: exit status, standard output, standard error."""

import contextlib
import io
import sys
from dataclasses import dataclass
from unittest import mock

from rig.cli import main

# The console script as a process of its own, from any directory.
RIG = (sys.executable, "-c", "from rig.cli import main; main()")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a call of the command left."""

    exit_code: int
    stdout: str
    stderr: str


def rig(*arguments: str) -> Outcome:
    """Call ``rig`` with ``arguments``, as the console script does."""
    out, err = io.StringIO(), io.StringIO()
    code: object = None
    with (
        mock.patch.object(sys, "argv", ["rig", *arguments]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as left:
            code = left.code
    return Outcome(int(code or 0), out.getvalue(), err.getvalue())  # type: ignore[call-overload]
