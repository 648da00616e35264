"""The one place that imports MuJoCo, so that a broken OpenGL set-up cannot break the import.

MuJoCo reads MUJOCO_GL while it is imported and fails as a whole when the named library is
missing. It is therefore imported with OpenGL switched off; ``gl_context`` asks for a context
explicitly later, where a failure is one sentence instead of a half-imported package.
"""

import importlib
import os
import sys
from typing import Any

_VARIABLE = "MUJOCO_GL"


def wanted_backend() -> str:
    """What the user's MUJOCO_GL asks for, in lower case; empty when it is not set."""
    return os.environ.get(_VARIABLE, "").lower().strip()


def load_mujoco() -> Any:
    """The ``mujoco`` module, imported without touching OpenGL; the variable is left as it was."""
    if "mujoco" in sys.modules:
        return sys.modules["mujoco"]
    before = os.environ.get(_VARIABLE)
    os.environ[_VARIABLE] = "disable"
    try:
        return importlib.import_module("mujoco")
    finally:
        if before is None:
            del os.environ[_VARIABLE]
        else:
            os.environ[_VARIABLE] = before
