"""Imports of a library without the parts that are not used here."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_one_at_a_time: Final = threading.RLock()


@contextmanager
def hidden(module: str) -> Iterator[None]:
    """Hide a module from imports in the block, as if it were not installed, unless it is loaded
    already.
    """
    with _one_at_a_time:
        if module in sys.modules:
            yield
            return
        sys.modules[module] = None  # type: ignore[assignment]
        try:
            yield
        finally:
            del sys.modules[module]
