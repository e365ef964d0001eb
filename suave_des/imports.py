"""Imports of a library, and starts of a process, without the parts that are not used here."""

from __future__ import annotations

import importlib.util
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
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


def register_environments() -> None:
    """Make `gymnasium.make("suave_des/PipelineInspection-v0")` known."""
    from gymnasium import register

    register(id="suave_des/PipelineInspection-v0", entry_point="suave_des.interfaces.gym:PipelineInspection")


def when_imported(module: str, act: Callable[[], None]) -> None:
    """Call a function as soon as a module is imported, now if it is already.

    Gymnasium has no entry points for environments; importing it here for those who do not use it would be slow.
    """
    if module in sys.modules:
        act()
    else:
        sys.meta_path.insert(0, _Awaiting(module, act))


class _Awaiting(MetaPathFinder):
    """Finds a module as it would be found without it, and has a function called after its import."""

    def __init__(self, module: str, act: Callable[[], None]) -> None:
        self._module, self._act = module, act

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find the module."""
        if fullname != self._module:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is None or spec.loader is None:
            return spec
        execute, act = spec.loader.exec_module, self._act

        def execute_and_act(module: ModuleType) -> None:
            execute(module)
            act()

        spec.loader.exec_module = execute_and_act  # type: ignore[method-assign]
        return spec
