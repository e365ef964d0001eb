"""What is imported from where: libraries without the parts that are not used here, and users' own
modules from the current folder, which nothing else is looked for in.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec
from pathlib import Path
from types import FrameType, ModuleType


@contextmanager
def hidden(module: str, *, even_if_loaded: bool = False) -> Iterator[None]:
    """Hide a module from the imports of this thread in the block, as if it were not installed; one
    that is loaded already only `even_if_loaded`, and then from all threads.
    """
    if module not in sys.modules:
        finder = _FindsNone(module)
        sys.meta_path.insert(0, finder)
        try:
            yield
        finally:
            sys.meta_path.remove(finder)
    elif even_if_loaded:
        loaded = sys.modules[module]
        sys.modules[module] = None  # type: ignore[assignment]
        try:
            yield
        finally:
            sys.modules[module] = loaded
    else:
        yield


class _FindsNone:
    """Has the import of a module end as if there were none, in the thread that has made this."""

    def __init__(self, module: str) -> None:
        self._module = module
        self._thread = threading.get_ident()

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        """Find nothing, or, asked for the module by the thread, let nobody else find it.

        Raises:
            ModuleNotFoundError: it is the module.
        """
        if name == self._module and threading.get_ident() == self._thread:
            raise ModuleNotFoundError(f"{name} is hidden", name=name)


def leave_current_folder() -> None:
    """Take the current folder from the import path of a command, or each library would find files
    of the user's in it that happen to be named like modules.

    It is there under `python -m`, and where PYTHONPATH has an empty part, as after
    `export PYTHONPATH=$PYTHONPATH:more`. It stays if PYTHONPATH names it, or if it has this very
    package.
    """
    here = Path.cwd()
    named = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    if here not in (Path(__file__).parents[1], *map(Path.absolute, map(Path, named))):
        sys.path[:] = [place for place in sys.path if place and Path(place) != here]


class _Beside:
    """Finds modules in a folder that is not on the import path: those with one of some names, and
    what these import. (A class derived from importlib.abc would load much at each start.)
    """

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.names = set[str]()

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module; those in packages are found by these."""
        if path is not None or not ({name, _importer()} & self.names):
            return None
        return self.find(name)

    def find(self, name: str) -> ModuleSpec | None:
        """Find a module, which then can be imported, and so can what it imports."""
        spec = PathFinder.find_spec(name, [self.folder])
        if spec is not None:
            self.names.add(name)
        return spec


def _importer() -> str:
    """Return the name of the module, or of the package that it is in, whose code imports something
    now; empty if there is none.
    """
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        name = str(frame.f_globals.get("__name__", "")).partition(".")[0]
        if name != "importlib" and frame.f_globals is not globals():
            return name
        frame = frame.f_back
    return ""


_finders = dict[str, _Beside]()
_beside = list[str]()
"""The folder of the campaign file that was read last."""


def look_beside(file: Path) -> None:
    """Look for users' modules beside a file as well, after the current folder."""
    _beside[:] = [str(file.absolute().parent)]


def find_here(name: str) -> ModuleSpec | None:
    """Find a module that a user has named, on the import path or else in the current folder, or
    beside the campaign file; None if there is none.

    One of a folder can be imported from then on, and so can what it imports and lies beside it.

    Raises:
        ValueError: it is loaded, and not from a file.
    """
    if not name:
        raise ValueError("empty module name")
    if name in sys.modules:
        return find_spec(name)
    for finder in _finders.values():  # which may have had one of this name that is not loaded now
        finder.names.discard(name)
    found = find_spec(name)
    for folder in (str(Path.cwd()), *_beside):
        if found is None:
            finder = _finders.setdefault(folder, _Beside(folder))
            if finder not in sys.meta_path:
                sys.meta_path.append(finder)
            found = finder.find(name)
    return found
