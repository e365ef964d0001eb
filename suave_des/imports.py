"""Imports of a library, and starts of a process, without the parts that are not used here."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Final

_one_at_a_time: Final = threading.RLock()


@contextmanager
def hidden(module: str) -> Iterator[None]:
    """Hide a module from imports in the block, as if it were not installed, unless it is loaded already."""
    with _one_at_a_time:
        if module in sys.modules:
            yield
            return
        sys.modules[module] = None  # type: ignore[assignment]
        try:
            yield
        finally:
            del sys.modules[module]


@contextmanager
def main_hidden() -> Iterator[None]:
    """Hide the main script from multiprocessing, which would import it, and so run it, in a new process."""
    with _one_at_a_time:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main
