"""How the simulator's kernels are compiled: typed, cached on disk where possible, GIL released."""

from collections.abc import Callable
from typing import TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])


def jit(function: F) -> F:
    """Compile ``function`` with numba on first use.

    Where neither the source's folder nor the user's cache directory can be written numba
    refuses at import; then the kernel is compiled anew in each process instead.
    """
    options = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
    try:
        return cast(F, numba.njit(cache=True, **options)(function))
    except RuntimeError:
        return cast(F, numba.njit(**options)(function))
