"""What pydantic found wrong with a scenario, as one line with file, line, key path, value and remedy."""

from __future__ import annotations

import typing
from collections.abc import Iterable, Iterator, Mapping
from types import UnionType
from typing import Annotated, Any, Union

from pydantic import BaseModel, Tag, ValidationError
from pydantic_core import ErrorDetails

from suave_des.errors import InputError, KeyPath, did_you_mean, place_text, shown
from suave_des.scenario.layers import Layer
from suave_des.scenario.quantities import LONGEST_S, Choice, Distribution, Exponential, Normal, Uniform
from suave_des.scenario.signal_kinds import Signal


def _tags(union: Any) -> list[str]:
    """Names of a union's members, which pydantic puts into locations although no file has them."""
    members = typing.get_args(typing.get_args(union)[0])
    return [mark.tag for member in members for mark in member.__metadata__ if isinstance(mark, Tag)]


_MAPPING = "is not a mapping of keys to values"
_BOUNDS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
_TEXTS: Mapping[str, tuple[str, str]] = {
    # type of pydantic's error: (what is wrong with the value, what would be right)
    "missing": ("is missing", "add it"),
    "float_type": ("{value} is no number", "such as 12.5, without quotes"),
    "int_type": ("{value} is no whole number", "such as 3, without quotes"),
    "int_from_float": ("{value} is no whole number", "such as 3"),
    "finite_number": ("{value} is not finite", "give a finite number"),
    "string_type": ("{value} is no text", "put it in quotes"),
    "bool_type": ("{value} is neither true nor false", "write true or false"),
    "bool_parsing": ("{value} is neither true nor false", "write true or false"),
    "dict_type": (f"{{value}} {_MAPPING}", "write `key: value` lines under it, or leave it out"),
    "model_type": (f"{{value}} {_MAPPING}", "write `key: value` lines under it, or leave it out"),
    "model_attributes_type": (f"{{value}} {_MAPPING}", "write `key: value` lines under it, or leave it out"),
    "tuple_type": ("{value} is no list", "write it in brackets: [{value}]"),
    "string_pattern_mismatch": (
        "{value} is no name",
        "use letters, digits, _ . and -, beginning with a letter",
    ),
    "string_too_long": ("{value} is too long", "at most {max_length} characters"),
    "string_too_short": ("{value} is too short", "at least {min_length} characters"),
    "too_short": ("has {actual_length} entries", "at least {min_length} needed"),
    "too_long": ("has too many entries", "at most {max_length}"),
}


_DISTRIBUTIONS = (Normal, Uniform, Exponential, Choice)
_UNION_TAGS = {each for union in (Distribution, Signal) for each in _tags(union)}


def input_error(error: ValidationError, layer: Layer, model: type[BaseModel]) -> InputError:
    """The first thing wrong, the user's own file before its base, as one error that counts the others.

    Args:
        error: what pydantic raised for layer.data.
        layer: the data with their places.
        model: the model that was validated.
    """
    details = error.errors(include_url=False)
    first = min(details, key=lambda detail: _order(detail, layer))
    problem, remedy = _said(first, model)
    path = _nearest_to_user(first, layer)
    place = layer.place(path)
    if more := len(details) - 1:
        remedy += f"; and {more} more"
    return InputError(problem, file=place.file, place=place_text(place.line, path), remedy=remedy)


def _order(detail: ErrorDetails, layer: Layer) -> tuple[int, int, int]:
    # A misspelt key is also a missing one, and a list with a wrong entry too short: these say less and come last.
    place = layer.place(_key_path(detail["loc"], layer.data))
    missing_key = detail["type"] == "missing" and isinstance(detail["loc"][-1], str)
    return 2 if detail["type"] == "too_short" else int(missing_key), place.depth, place.line


def _key_path(loc: tuple[int | str, ...], data: object) -> KeyPath:
    """The key path as it stands in the file: pydantic's location without the names of union members."""
    path: list[str | int] = []
    for index, key in enumerate(loc):
        last = index == len(loc) - 1
        if isinstance(data, dict) and key in data:
            data = data[key]
        elif isinstance(data, list) and isinstance(key, int):
            data = data[key] if key < len(data) else None
        elif key in _UNION_TAGS or key == "[key]" or (not isinstance(data, dict | str) and not last):
            continue
        path.append(key)
    return tuple(path)


def _nearest_to_user(detail: ErrorDetails, layer: Layer) -> KeyPath:
    """Key path of the value at fault; of keys that do not fit together, the one in the user's own file."""
    path = _key_path(detail["loc"], layer.data)
    keys = [key for key in str(detail.get("ctx", {}).get("keys", "")).split() if (*path, key) in layer.places]
    candidates: Iterable[KeyPath] = [(*path, key) for key in keys] or [path]
    return min(candidates, key=lambda candidate: layer.place(candidate).depth)


def _said(detail: ErrorDetails, model: type[BaseModel]) -> tuple[str, str]:
    kind, value, context = detail["type"], detail["input"], detail.get("ctx", {})
    loc = detail["loc"]
    if kind == "extra_forbidden":
        return f"unknown key {shown(loc[-1])}", _right_key(model, loc)
    if kind == "wrong":
        return str(context["problem"]), str(context["remedy"])
    if kind == "wrong_kind":
        return _wrong_kind(value, str(context["key"]), str(context["known"]).split(), str(context["also"]))
    if kind == "literal_error":
        known_words = typing.get_args(_annotation_at(model, loc)) or (context["expected"],)
        return f"{shown(value)} is not allowed", did_you_mean(value, map(str, known_words), "allowed")
    if kind == "value_error":
        return str(context["error"]), "see docs/reference/scenario.md"
    if kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        exceeded = next(bound for key, bound in context.items() if key in _BOUNDS)
        return f"{shown(value)} is out of range", f"must be {_range_at(model, loc, exceeded) or _bound(context)}"
    if kind == "float_type" and loc[-1] == "number":
        return f"{shown(value)} is no number", "give a number without quotes, or a distribution"
    if value is None and kind in ("dict_type", "model_type", "model_attributes_type"):
        return "has nothing under it", "write `key: value` lines under it, or leave it out"
    problem, remedy = _TEXTS.get(kind, (f"{{value}}: {detail['msg']}", "see docs/reference/scenario.md"))
    facts = {"value": shown(value), **context}
    return problem.format(**facts), remedy.format(**facts)


def _right_key(model: type[BaseModel], loc: tuple[int | str, ...]) -> str:
    """Where a key that is known elsewhere belongs; else the nearest that is known here."""
    if homes := list(dict.fromkeys(_homes(model, str(loc[-1]), ""))):
        return f"it belongs {' or '.join(homes)}"
    here = model_at(model, loc[:-1])
    return did_you_mean(loc[-1], here.model_fields if here else ())


def _homes(model: type[BaseModel], key: str, path: str) -> Iterator[str]:
    """Places of mappings that have a key; the parameters of distributions do not count, which may stand anywhere."""
    for name, field in model.model_fields.items():
        if name == key:
            yield f"under {path}" if path else "at the top level"
        below = f"{path}.{name}" if path else name
        for suffix, inner in _mappings(field.annotation):
            if inner not in _DISTRIBUTIONS:
                yield from _homes(inner, key, below + suffix)


def _mappings(wanted: Any) -> Iterator[tuple[str, type[BaseModel]]]:
    """Models that a type holds, with what stands for the name or number of an entry."""
    if isinstance(wanted, type) and issubclass(wanted, BaseModel):
        yield "", wanted
        return
    entry = {dict: ".NAME", tuple: "[]"}.get(typing.get_origin(wanted), "")
    for argument in typing.get_args(wanted):
        yield from ((entry + suffix, inner) for suffix, inner in _mappings(argument))


def _wrong_kind(value: object, key: str, known: list[str], also: str) -> tuple[str, str]:
    """A mapping whose kind (or distribution) is not given or not known, or no mapping at all."""
    if not isinstance(value, dict):
        return f"{shown(value)} {_MAPPING}", f"{also}give a mapping with {key}: {', '.join(known)}"
    if key not in value:
        return f"{key} is missing", f"{also}add {key}: {', '.join(known)}"
    return f"{key} {shown(value[key])} is not known", did_you_mean(value[key], known)


def _range_at(model: type[BaseModel], loc: tuple[int | str, ...], exceeded: float) -> str:
    """The range that a number of the model must lie in, in words, without bounds that nobody is near."""
    owner = model_at(model, loc[:-1])
    marks = owner.model_fields[str(loc[-1])].metadata if owner else []
    bounds = {key: getattr(mark, key) for mark in marks for key in _BOUNDS if getattr(mark, key, None) is not None}
    told = {key: bound for key, bound in bounds.items() if abs(bound) < LONGEST_S or bound == exceeded}
    return _bound(told)


def _bound(context: Mapping[str, Any]) -> str:
    return " and ".join(f"{text} {context[key]:g}" for key, text in _BOUNDS.items() if context.get(key) is not None)


def _annotation_at(model: type[BaseModel], loc: tuple[int | str, ...]) -> Any:
    """Type that the model wants at one of pydantic's locations; None where it has none."""
    wanted: Any = model
    for key in loc:
        wanted = _step(wanted, key)
    return _bare(wanted)


def model_at(model: type[BaseModel], loc: tuple[int | str, ...]) -> type[BaseModel] | None:
    """The model that stands at one of pydantic's locations, or None."""
    wanted = _annotation_at(model, loc)
    return wanted if isinstance(wanted, type) and issubclass(wanted, BaseModel) else None


def _step(wanted: Any, key: int | str) -> Any:
    wanted = _bare(wanted)
    if typing.get_origin(wanted) in (Union, UnionType):
        for member in typing.get_args(wanted):
            if Tag(str(key)) in getattr(member, "__metadata__", ()):
                return member
        return None
    if isinstance(wanted, type) and issubclass(wanted, BaseModel):
        field = wanted.model_fields.get(str(key))
        return field.annotation if field else None
    arguments = typing.get_args(wanted)
    return arguments[-1 if typing.get_origin(wanted) is dict else 0] if arguments else None


def _bare(wanted: Any) -> Any:
    """A type without Annotated and without the None of an optional one."""
    while typing.get_origin(wanted) is Annotated:
        wanted = typing.get_args(wanted)[0]
    if typing.get_origin(wanted) in (Union, UnionType):
        members = [member for member in typing.get_args(wanted) if member is not type(None)]
        return _bare(members[0]) if len(members) == 1 else wanted
    return wanted
