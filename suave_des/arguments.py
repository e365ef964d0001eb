"""Calls of public functions with arguments that they do not have, or of another type: errors in plain words."""

from __future__ import annotations

import functools
import inspect
import os
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from numbers import Integral, Real
from typing import Any, Final, ParamSpec, TypeVar

from suave_des.errors import InputError, did_you_mean, shown

_P = ParamSpec("_P")
_R = TypeVar("_R")

_KINDS: Final[Mapping[str, tuple[Any, str]]] = {
    "int": (Integral, "a whole number"),
    "float": (Real, "a number"),
    "bool": (bool, "True or False"),
    "str": (str, "a name"),
    "Path": (os.PathLike, "a path"),
    "None": (type(None), "None"),
    "Mapping": (Mapping, "a mapping"),
    "Sequence": (Iterable, "a list"),
    "Iterable": (Iterable, "a list"),
}
"""What annotations stand for, and how it is called. Anything that has values will do for a list, but a single name."""
_CLASSES: Final = {"LoadedScenario": "a loaded scenario", "Simulator": "a Simulator"}


def plain_arguments(
    options: Callable[[], Mapping[str, object]] = dict,
) -> Callable[[Callable[_P, _R]], Callable[_P, _R]]:
    """Check each call of a function against its signature; an annotation that has further classes is not looked at.

    Args:
        options: returns the annotations of what its **options may be, by name.
    """

    def checked(function: Callable[_P, _R]) -> Callable[_P, _R]:
        signature = inspect.signature(function)
        name_shown = function.__qualname__.removesuffix(".__init__")
        named = {
            name: str(each.annotation)
            for name, each in signature.parameters.items()
            if each.kind not in (each.VAR_KEYWORD, each.VAR_POSITIONAL)
        }

        @functools.wraps(function)
        def call(*args: _P.args, **given: _P.kwargs) -> _R:
            annotations = {**named, **options(), **named}
            check_names(name_shown, given, annotations)
            try:
                bound = signature.bind(*args, **given)
            except TypeError as error:
                known = ", ".join(annotations)
                raise InputError(f"{name_shown}: {error}", remedy=f"its arguments: {known}") from None
            for name, value in {**bound.arguments, **given}.items():
                if name in annotations:
                    _check(name, value, annotations[name])
            return function(*args, **given)

        return call

    return checked


def check_names(function: str, given: Iterable[str], known: Collection[str]) -> None:
    """Check that a function has the arguments that it is given.

    Raises:
        InputError: it has not.
    """
    if unknown := [name for name in given if name not in known]:
        listed = [name for name in known if name not in ("self", "cls")]
        remedy = did_you_mean(unknown[0], listed, "its arguments")
        raise InputError(f"{function} has no argument {unknown[0]!r}", remedy=remedy)


def _check(name: str, value: Any, annotation: object) -> None:
    written = getattr(annotation, "__forward_arg__", None) or str(annotation)
    parts = re.sub(r"\[.*\]", "", written).split(" | ")
    if not all(part in _KINDS or part in _CLASSES for part in parts):
        return
    bases = {base.__name__ for base in type(value).__mro__}
    if not any(_is_a(part, value) if part in _KINDS else part in bases for part in parts):
        words = [_CLASSES[part] if part in _CLASSES else _KINDS[part][1] for part in parts if part != "None"]
        wanted = " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))
        raise InputError(f"{name}: expected {wanted}, got {shown(value)}", remedy="see its help()")


def _is_a(kind: str, value: object) -> bool:
    is_other = isinstance(value, bool) if kind in ("int", "float") else isinstance(value, str | bytes) and kind != "str"
    return isinstance(value, _KINDS[kind][0]) and not is_other
