"""The one way kernels are compiled: typed, cached on disk where that is possible, GIL released."""

from collections.abc import Callable
from typing import TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])


def jit(function: F) -> F:
    """Compile ``function`` with numba on first use.

    The compiled code is cached beside the source or in the user's cache directory. Where
    neither can be written (a read-only install without a home) numba refuses at import;
    then it is compiled anew in each process instead.
    """
    try:
        return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy")(function))
    except RuntimeError:
        return cast(F, numba.njit(nogil=True, error_model="numpy")(function))
