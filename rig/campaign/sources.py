"""Which version of the program this is, exactly: rows of two versions must not be mixed."""

import hashlib
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_PACKAGES = ("rig", "drivers", "estimator", "sim_backend")


@cache
def sources_here() -> str:
    """The version, and a hash of all the program's files on this machine."""
    root = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for package in _PACKAGES:
        for source in sorted((root / package).rglob("*.py")):
            digest.update(source.relative_to(root).as_posix().encode() + b"\0")
            digest.update(source.read_bytes())
    try:
        number = version("activerig")
    except PackageNotFoundError:  # run from a source tree that is not installed
        number = "uninstalled"
    return f"{number}+{digest.hexdigest()[:12]}"
