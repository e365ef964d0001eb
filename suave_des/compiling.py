"""How inner loops are compiled: numba, with the machine code kept on disk between processes."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

_F = TypeVar("_F", bound=Callable[..., Any])
_LINEAR_ALGEBRA = "scipy.linalg"


def _load_numba() -> None:
    """Load what numba needs for arrays, without the linear algebra that it would look for in SciPy.

    No loop here multiplies matrices, and looking for it takes each process as long as fifty missions.
    """
    if _LINEAR_ALGEBRA in sys.modules:
        return
    sys.modules[_LINEAR_ALGEBRA] = cast(Any, None)  # Python's way to say that there is no such module
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        del sys.modules[_LINEAR_ALGEBRA]


_load_numba()


def compiled(function: _F) -> _F:
    """Compile a function of arrays and numbers on its first call (division by zero gives inf or nan, as in numpy)."""
    return cast(_F, numba.njit(cache=True, error_model="numpy")(function))
