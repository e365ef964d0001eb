"""Calls of public functions with arguments that they do not have, or of another type: errors in
plain words.
"""

from __future__ import annotations

import functools
import inspect
import os
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from numbers import Integral, Real
from typing import ParamSpec, TypeVar

from suave_des.errors import InputError, shown, unknown

_P = ParamSpec("_P")
_R = TypeVar("_R")

_KINDS: Mapping[str, tuple[type | str, str]] = {
    "int": (Integral, "a whole number"),
    "float": (Real, "a number"),
    "bool": (bool, "True or False"),
    "str": (str, "a name"),
    "Path": (os.PathLike, "a path"),
    "None": (type(None), ""),
    "Mapping": (Mapping, "a mapping"),
    "Sequence": (Iterable, "a list"),
    "Iterable": (Iterable, "a list"),
    # by its name: its module imports this one
    "LoadedScenario": ("LoadedScenario", "a loaded scenario"),
}
"""What annotations stand for, and how it is called. Anything that has values will do for a list,
but a single name.
"""


def plain_arguments(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Check each call of a function against its signature; an annotation that has further classes
    is not looked at.
    """
    signature = inspect.signature(function)
    name_shown = function.__qualname__.removesuffix(".__init__")
    parameters = signature.parameters.values()
    own = {each.name: str(each.annotation) for each in parameters if each.kind != each.VAR_KEYWORD}
    options = next((str(each.annotation) for each in parameters if each.name not in own), "")

    @functools.wraps(function)
    def call(*args: _P.args, **given: _P.kwargs) -> _R:
        typed = function.__globals__.get(options.removeprefix("Unpack[").removesuffix("]"))
        known = own | {
            name: each.__forward_arg__
            for name, each in getattr(typed, "__annotations__", {}).items()
        }
        if options != "Any":
            check_names(name_shown, given, known)
        try:
            bound = signature.bind(*args, **given)
        except TypeError as error:
            raise InputError(
                f"{name_shown}: {error}", remedy=f"its arguments: {', '.join(known)}"
            ) from None
        for name, value in {**bound.arguments, **given}.items():
            _check(name, value, known.get(name, "Any"))
        return function(*args, **given)

    return call


def check_names(function: str, given: Iterable[str], known: Collection[str]) -> None:
    """Raise an InputError if a function is given an argument that it does not have."""
    for name in given:
        if name not in known:
            listed = [each for each in known if each not in ("self", "cls")]
            raise unknown(f"{function} has no argument {name!r}", name, listed, "its arguments")


def _check(name: str, value: object, annotation: str) -> None:
    parts = re.sub(r"\[.*\]", "", annotation).split(" | ")
    if all(part in _KINDS for part in parts) and not any(_is_a(part, value) for part in parts):
        words = [_KINDS[part][1] for part in parts if part != "None"]
        wanted = " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))
        raise InputError(f"{name}: expected {wanted}, got {shown(value)}", remedy="see its help()")


def _is_a(part: str, value: object) -> bool:
    kind = _KINDS[part][0]
    if isinstance(kind, str):
        return any(base.__name__ == kind for base in type(value).__mro__)
    if part in ("int", "float") and isinstance(value, bool):
        return False
    if part in ("Sequence", "Iterable") and isinstance(value, str | bytes):
        return False
    return isinstance(value, kind)
