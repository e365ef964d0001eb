"""Sending users' managers and functions to other processes and machines: as files, or by value."""

from __future__ import annotations

import ast
import importlib.util
import pickle
import sys
import sysconfig
from collections.abc import Iterable, Iterator, Mapping
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import MappingProxyType

import suave_des
from suave_des.errors import InputError
from suave_des.registry import manager_class, takes_argument

_INSTALLED = (
    *(Path(sysconfig.get_path(kind)).resolve() for kind in ("stdlib", "platstdlib", "purelib", "platlib")),
    Path(suave_des.__file__).resolve().parent,
)
_FOLDERS_OF_PACKAGES = ("site-packages", "dist-packages")


def user_modules(managers: Iterable[str], functions: Mapping[str, type] = MappingProxyType({})) -> dict[str, Path]:
    """Files that define managers and functions, and what these import: all that no package manager installed.

    Imports are read from the source, so that one inside a function counts too; one by a computed name does not.

    Args:
        managers: names, or module:Class.
        functions: classes of user-defined functions, by the name of the function.

    Returns:
        Each file by its place below a folder of modules, such as "package/module.py".

    Raises:
        InputError: a module cannot travel: it is a script or a notebook, or is compiled.
    """
    found: dict[str, Path] = {}
    defining: list[tuple[str, tuple[str, ...]]] = [
        (f"function {name!r}", (kind.__module__,)) for name, kind in functions.items()
    ]
    for manager in managers:
        defined_in = manager_class(manager).__module__
        is_module = ":" in manager and not takes_argument(manager)
        named = manager.partition(":")[0] if is_module else defined_in
        defining.append((f"manager {manager!r}", (named, defined_in)))
    for what, modules in defining:
        for module in dict.fromkeys(modules):
            if module == "__main__":
                raise InputError(
                    f"{what} is defined in a script or a notebook, which workers do not have",
                    remedy="put the class into a separate module, beside it",
                )
            _add(found, module)
    return found


def _add(found: dict[str, Path], module: str) -> None:
    """Add a module, the packages that it is in, and what they import, if they are the user's own."""
    parts = module.split(".")
    for depth in range(1, len(parts) + 1):
        name = ".".join(parts[:depth])
        spec = _spec(name)
        if spec is None or not _is_users(spec):
            return
        if not spec.has_location or spec.origin is None:
            continue  # a folder without __init__.py
        path = Path(spec.origin)
        if path.suffix != ".py":
            raise InputError(
                "is compiled, so it cannot be sent to workers", file=path, remedy="install it with pip, there and here"
            )
        is_package = spec.submodule_search_locations is not None
        place = "/".join(parts[:depth]) + ("/__init__.py" if is_package else ".py")
        if place not in found:
            found[place] = path
            for imported in _imports(path, name if is_package else name.rpartition(".")[0]):
                _add(found, imported)


def _spec(name: str) -> ModuleSpec | None:
    loaded = sys.modules.get(name)
    if loaded is not None:
        return loaded.__spec__
    try:
        return importlib.util.find_spec(name)
    except (ImportError, AttributeError, ValueError):  # a name in a module rather than a module
        return None


def _is_users(spec: ModuleSpec) -> bool:
    if spec.has_location and spec.origin is not None:
        places = [spec.origin]
    else:
        places = list(spec.submodule_search_locations or ())
    paths = [Path(place).resolve() for place in places]
    return bool(paths) and not any(map(_is_installed, paths))


def _is_installed(path: Path) -> bool:
    in_packages = not set(path.parts).isdisjoint(_FOLDERS_OF_PACKAGES)
    return in_packages or any(path.is_relative_to(folder) for folder in _INSTALLED)


def _imports(path: Path, package: str) -> Iterator[str]:
    """Names that a file imports; some of them may be names in modules."""
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):  # an import that is not reached, or it would have been raised
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            name = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) + 1 - node.level]
                name = ".".join([*above, *([name] if name else [])])
            yield name
            yield from (f"{name}.{alias.name}" for alias in node.names)


# Managers of a notebook or a prompt, which worker processes could not import.

_MAIN = "__main__"


def main_classes(managers: Iterable[str]) -> bytes | None:
    """Pack the classes among managers that are defined in a main program without a file, with all that they use.

    Returns:
        What `define_in_main` takes; None if there are none, as in a script, which workers import.
    """
    names = [name for name in managers if name.startswith(f"{_MAIN}:")]
    file = getattr(sys.modules[_MAIN], "__file__", None)
    if not names or (file is not None and Path(file).is_file()):  # a program from standard input is "<stdin>"
        return None
    import cloudpickle  # takes a class by its content where it cannot be imported

    packed: bytes = cloudpickle.dumps({name.partition(":")[2]: manager_class(name) for name in names})
    return packed


def define_in_main(packed: bytes) -> None:
    """Define the classes in this process's main program, where missions look for them."""
    for name, each in pickle.loads(packed).items():
        setattr(sys.modules[_MAIN], name, each)
