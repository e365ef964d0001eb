"""How inner loops are compiled: numba, with the machine code kept on disk between processes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

_F = TypeVar("_F", bound=Callable[..., Any])


def compiled(function: _F) -> _F:
    """Compile a function of arrays and numbers on its first call (division by zero gives inf or nan, as in numpy)."""
    return cast(_F, numba.njit(cache=True, error_model="numpy")(function))
