"""How kernels are compiled: typed, cached per version of their sources, the GIL released."""

import hashlib
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

import numba
from numba.extending import register_jitable

F = TypeVar("F", bound=Callable[..., object])

_OPTIONS = {"nogil": True, "error_model": "numpy"}
# Sums may be reordered and divisions shared, so that the compiler works on several numbers at once.
_REORDERED = frozenset({"contract", "reassoc", "nsz", "arcp"})
_VERSIONS_KEPT = 4


def jit(function: F) -> F:
    """Compile ``function`` with numba on first use, once per version of the kernels.

    The compiled code is cached in the user's cache directory. Where that cannot be written it
    goes beside the source, and where neither can be, each process compiles anew.
    """
    return _compiled(function)


def jit_sums(function: F) -> F:
    """As `jit`, for kernels whose sums may be taken in any order: not where NaN is compared."""
    return _compiled(function, fastmath=_REORDERED)


def jit_inlined(function: F) -> F:
    """As `jit_sums`, for what a loop of `jit_sums` calls: only then it takes several at a time."""
    return _compiled(function, fastmath=_REORDERED, forceinline=True)


def jit_template(function: F) -> F:
    """For what kernels call but do not share: compiled, and cached, within each of them.

    So a template can take functions, which `jit` could not cache. Called from Python it is Python.
    """
    return cast(F, register_jitable(function))


def _compiled(function: F, fastmath: frozenset[str] = frozenset(), forceinline: bool = False) -> F:
    options = {**_OPTIONS, "fastmath": set(fastmath), "forceinline": forceinline}
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = _CACHE_DIR
    try:
        return cast(F, numba.njit(cache=True, **options)(function))
    except RuntimeError:  # no place to cache in
        return cast(F, numba.njit(**options)(function))
    finally:
        numba.config.CACHE_DIR = before


def _cache_dir() -> str:
    """A directory for just these kernels and this numba, or what numba chooses without a home.

    Numba looks at one file's date only: a kernel that was inlined from another file would stay
    in its old version after an update. So the name holds a hash of all files with kernels.
    """
    package = Path(__file__).parent
    digest = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    for source in sorted(package.rglob("*.py")):
        content = source.read_bytes()
        if b"jit" in content:
            digest.update(content)
    try:
        root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "activerig"
    except RuntimeError:
        return str(numba.config.CACHE_DIR)
    chosen = root / f"{package.name}-{digest.hexdigest()[:16]}"
    if not chosen.exists():
        others = sorted(root.glob(f"{package.name}-*"), key=lambda path: path.stat().st_mtime)
        for outdated in others[: 1 - _VERSIONS_KEPT]:
            shutil.rmtree(outdated, ignore_errors=True)
    return str(chosen)


_CACHE_DIR = _cache_dir()
