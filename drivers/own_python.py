"""Starting another process of this program."""

import sys


def own_python(module: str, entry: str = "main") -> list[str]:
    """The command that calls ``entry`` of ``module`` in a new interpreter; arguments may follow.

    It searches where this one searches. Not ``-m``, which would search the current directory
    first: any file of a user's that is named like one of Python's would run in its place.
    """
    code = f"import sys; sys.path[:] = {sys.path!r}; from {module} import {entry} as entry"
    return [sys.executable, "-P", "-c", f"{code}; sys.exit(entry())"]
