"""Compilation of inner loops by numba, with the machine code cached on disk between processes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

from suave_des.imports import hidden

# What numba would load on the first call. To see that there is a BLAS, it imports scipy.linalg, which takes 0.2 s and
# is used by no inner loop. There is one, as scipy is installed; what uses it imports it then.
with hidden("scipy.linalg"):
    from numba.np import arraymath
arraymath._HAVE_BLAS = True

Array = NDArray[np.float64]
Ticks = NDArray[np.int64]

_F = TypeVar("_F", bound=Callable[..., Any])


def compiled(function: _F) -> _F:
    """Compile a function of arrays and numbers on its first call (division by zero gives inf or nan, as in numpy)."""
    return cast(_F, numba.njit(cache=True, error_model="numpy")(function))
