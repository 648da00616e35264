"""Which sources the program has, exactly: rows of two versions must not be mixed."""

import hashlib
from functools import cache
from pathlib import Path

_PACKAGES = ("rig", "drivers", "estimator", "sim_backend")


@cache
def sources_here() -> str:
    """A hash of all the program's files on this machine, installed or not."""
    root = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for package in _PACKAGES:
        for source in sorted((root / package).rglob("*.py")):
            digest.update(source.relative_to(root).as_posix().encode() + b"\0")
            digest.update(source.read_bytes())
    return digest.hexdigest()[:12]
