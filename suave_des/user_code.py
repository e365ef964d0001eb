"""The code of users' managers and functions: it decides results, and is sent to other machines."""

from __future__ import annotations

import ast
import importlib.util
import logging
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from contextlib import suppress
from importlib.machinery import ModuleSpec
from pathlib import Path

import suave_des
from suave_des.errors import relative_path, shown
from suave_des.imports import find_here
from suave_des.registry import is_built_in, manager_class, takes_argument
from suave_des.resources import shown_name

MAIN = "__main__.py"
"""Place of a script that defines a class itself."""
_KINDS = ("stdlib", "platstdlib", "purelib", "platlib")
_INSTALLED = (
    *(Path(sysconfig.get_path(kind)).resolve() for kind in _KINDS),
    Path(suave_des.__file__).resolve().parent,
)
_told: set[tuple[Path, str]] = set()
"""Files, and the code that they name, of which this process has said so."""


def tell_code(file: Path, names: Iterable[str]) -> None:
    """Say, before it is run, that a file names code, and where that is; once in a process."""
    for name in sorted(names):
        if (file, name) in _told or ":" not in name or is_built_in(name):
            continue
        _told.add((file, name))
        logger = logging.getLogger("suave_des")
        logger.warning("note: %s has %s run", shown_name(file), _described(name))


def _described(name: str) -> str:
    """Say what the name of a manager or a class stands for: a command, or code and its place."""
    kind, _, command = name.partition(":")
    if takes_argument(name):
        return f"the command {shown(command)}"
    spec = _spec(kind.partition(".")[0])
    if spec is None:
        return f"the code of {name}"
    return f"the code of {name} ({relative_path(spec.origin or kind)})"


def _defining(managers: Iterable[str], functions: Iterable[type]) -> list[str]:
    """Return the modules that managers are named with, and those in which they and functions are
    defined.
    """
    modules = [kind.__module__ for kind in functions]
    for manager in managers:
        if not is_built_in(manager) and not takes_argument(manager):
            modules += [manager.partition(":")[0]] if ":" in manager else []
            modules.append(manager_class(manager).__module__)
    return list(dict.fromkeys(modules))


def code_files(managers: Iterable[str], functions: Iterable[type]) -> dict[str, Path]:
    """Find the files that define managers and functions by their places, as user_modules does; of
    a class that a package has installed, its module.
    """
    found = user_modules(managers, functions)
    for module in _defining(managers, functions):
        path = Path(getattr(sys.modules[module], "__file__", None) or "")
        if path.is_file() and path not in found.values():
            found[f"{module.replace('.', '/')}{path.suffix}"] = path
    return found


def user_modules(managers: Iterable[str], functions: Iterable[type]) -> dict[str, Path]:
    """Find the files that define managers and functions, and what these import: all that no package
    manager installed.

    Imports are read from the source, so that one inside a function counts too; one by a computed
    name does not.

    Returns:
        Each file by its place below a folder of modules, such as "package/module.py"; a script is
        at MAIN.
    """
    found: dict[str, Path] = {}
    names = _defining(managers, functions)
    if "__main__" in names:
        names.remove("__main__")
        script = Path(getattr(sys.modules["__main__"], "__file__", None) or "")
        if script.is_file():  # and no notebook
            found[MAIN] = script
            names += _imports(script, "")
    for name in names:  # it grows
        for place, path, package in _files_of(name):
            if place not in found:
                found[place] = path
                names += _imports(path, package)
    return found


def _files_of(name: str) -> Iterator[tuple[str, Path, str]]:
    """Yield the files of a module of the user's and of the packages that it is in: place, path, and
    the package from which it imports.
    """
    parts = name.split(".")
    for depth in range(1, len(parts) + 1):
        within = ".".join(parts[:depth])
        spec = _spec(within)
        if spec is None or not _is_users(spec):
            return
        if not spec.has_location or spec.origin is None:
            continue  # a folder without __init__.py
        path = Path(spec.origin)
        place = "/".join(parts[:depth])
        if spec.submodule_search_locations is None:
            yield f"{place}{path.suffix}", path, within.rpartition(".")[0]
        else:
            yield f"{place}/__init__{path.suffix}", path, within


def _spec(name: str) -> ModuleSpec | None:
    loaded = sys.modules.get(name)
    try:
        if loaded is not None:
            return loaded.__spec__
        return importlib.util.find_spec(name) if "." in name else find_here(name)
    except (ImportError, AttributeError, ValueError):  # a name in a module rather than a module
        return None


def _is_users(spec: ModuleSpec) -> bool:
    if spec.has_location and spec.origin:
        places = [spec.origin]
    else:
        places = [*(spec.submodule_search_locations or ())]
    return bool(places) and not any(_is_installed(Path(place).resolve()) for place in places)


def _is_installed(path: Path) -> bool:
    if {"site-packages", "dist-packages"} & {*path.parts}:
        return True
    return any(map(path.is_relative_to, _INSTALLED))


def _imports(path: Path, package: str) -> Iterator[str]:
    """Yield the names that a file imports; some of them may be names in modules."""
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):  # compiled, or not reached, or it would have been raised
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            with suppress(ImportError):  # one that cannot be reached
                name = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
                yield name
                yield from (f"{name}.{alias.name}" for alias in node.names)
