"""What the models of scenarios say: JSON Schema, the meaning of each key, and errors with file and line."""

from __future__ import annotations

import ast
import inspect
import re
import sys
import typing
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from suave_des.errors import InputError, KeyPath, did_you_mean, shown
from suave_des.scenario.models import Scenario
from suave_des.scenario.yamlfile import Layer

_WITH_NAMED_ENTRIES = (("Scenario", "signals"), ("KnowledgeSettings", "values"))
_EVENT_TEXT = r"^\s*\(\s*[1-6]\s*,\s*(failure|recovery)\s*,[^,]+\)\s*$"


def scenario_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a scenario file.

    What a mapping needs may stand in the base that it differs from: the loader alone checks that, and relations
    between values, such as a minimum that must not be above its maximum.
    """
    whole = Scenario.model_json_schema()
    definitions: dict[str, Any] = whole.pop("$defs")
    definitions["Scenario"] = whole
    for model in dict.fromkeys(model for _, model in models_within(Scenario)):
        for name, text in field_docs(model).items():
            definitions[model.__name__]["properties"][name]["description"] = text
    definitions = {name: _partial(definition) for name, definition in definitions.items()}
    event = {"anyOf": [definitions["ThrusterEvent"], {"type": "string", "pattern": _EVENT_TEXT}]}
    definitions["ThrusterEvent"] = event
    for named in ("signals", "default_modes"):
        definitions["Scenario"]["properties"][named]["additionalProperties"] = False  # other names than are allowed
    for name, key in _WITH_NAMED_ENTRIES:  # over a base, a null removes an entry
        entries = definitions[name]["properties"][key]
        allowed = entries.get("patternProperties", entries)
        for each in ("additionalProperties",) if allowed is entries else tuple(allowed):
            allowed[each] = {"anyOf": [allowed[each], {"type": "null"}]}
    base = {"type": ["string", "number"], "description": "Name or path of what this differs from."}
    for key, model_name in (("revision", "Revision"), ("vehicle", "VehicleDescription")):
        definitions[model_name]["properties"]["base"] = base
        part = definitions["Scenario"]["properties"][key]
        definitions["Scenario"]["properties"][key] = {"anyOf": [base, part], "description": part["description"]}
    definitions["Scenario"]["properties"]["base"] = base
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "suave-des scenario",
        "$ref": "#/$defs/Scenario",
        "anyOf": [{"required": ["base"]}, {"required": ["revision", "signals"]}],
        "$defs": definitions,
    }


def _partial(schema: Any) -> Any:
    """The same schema with nothing required; a mapping may then fit several members of a union."""
    if isinstance(schema, list):
        return list(map(_partial, schema))
    if not isinstance(schema, dict):
        return schema
    kept = {key: each for key, each in schema.items() if key not in ("discriminator", "required")}
    return {"anyOf" if key == "oneOf" else key: _partial(each) for key, each in kept.items()}


def field_docs(model: type[BaseModel]) -> dict[str, str]:
    """What each field of a model means: the text under it in the source."""
    texts: dict[str, str] = {}
    for part in reversed(model.__mro__):
        if part is BaseModel or not issubclass(part, BaseModel):
            continue
        body = _classes(part.__module__)[part.__name__].body
        for field, text in pairwise(body):
            if (
                isinstance(field, ast.AnnAssign)
                and isinstance(field.target, ast.Name)
                and isinstance(text, ast.Expr)
                and isinstance(text.value, ast.Constant)
            ):
                texts[field.target.id] = inspect.cleandoc(str(text.value.value))
    return texts


@cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    """The definitions of a module's classes, whose source is parsed once for all of them."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}


# Errors of validation, with file and line.

_TAGGED = ("kind", "distribution", "type")
"""Keys whose word tells the members of a union apart."""
_ANY = "*"
"""Stands for any name or number of an entry in the key path of a model."""
AnyModel = TypeVar("AnyModel", bound=BaseModel)


def validated(layer: Layer, model: type[AnyModel]) -> AnyModel:
    """Return the data of a layer as a model.

    Raises:
        InputError: they are not valid, see input_error.
    """
    try:
        return model.model_validate(layer.data)
    except ValidationError as error:
        raise input_error(error, layer, model) from None


def input_error(error: ValidationError, layer: Layer, model: Any) -> InputError:
    """Return the first problem, of the user's own file before its base, as one error that counts the others.

    Args:
        error: what pydantic raised for layer.data.
        layer: the data with their places.
        model: the model, or other type, that was validated.
    """

    def order(found: tuple[KeyPath, ErrorDetails]) -> tuple[int, int, int]:
        # A misspelt key is also a missing one, and a list with a wrong entry too short: report these last.
        place = layer.place(found[0])
        return {"missing": 1, "too_short": 2}.get(found[1]["type"], 0), place.depth, place.line

    found = [(_key_path(each, layer), each) for each in error.errors(include_url=False)]
    path, first = min(found, key=order)
    problem, remedy = _texts(first, path, model)
    more = f"and {len(found) - 1} more" if len(found) > 1 else None
    return layer.error(problem, path, "; ".join(filter(None, (remedy, more))) or None)


def problem_and_remedy(error: ValidationError, data: dict[str, Any], model: Any) -> tuple[KeyPath, str, str | None]:
    """Return the first problem of data that are in no file: its key path, what is wrong, and what would be right.

    Args:
        error: what pydantic raised for the data.
        data: what was validated.
        model: the model, or other type, that they were to be.
    """
    first = min(error.errors(include_url=False), key=lambda detail: detail["type"] == "missing")
    path = (*_key_path(first, Layer(data, {})), *first.get("ctx", {}).get("keys", "").split()[:1])
    return path, *_texts(first, path, model)


def models_within(wanted: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], type[BaseModel]]]:
    """Yield every model that a type holds, with its key path; members of a union have the same."""
    if isinstance(wanted, type) and issubclass(wanted, BaseModel):
        yield path, wanted
        for name, field in wanted.model_fields.items():
            yield from models_within(field.annotation, (*path, name))
        return
    entry = (_ANY,) if typing.get_origin(wanted) in (dict, tuple) else ()
    for argument in typing.get_args(wanted):
        yield from models_within(argument, (*path, *entry))


def _key_path(detail: ErrorDetails, layer: Layer) -> KeyPath:
    """The key path in the file: pydantic's location without what is no key, such as the tags of union members.

    Of keys that do not fit together, and have a place each, it is the one in the user's own file.
    """
    path: list[str | int] = []
    here: Any = layer.data
    for key in detail["loc"]:
        if isinstance(here, dict) and key in here:
            here = here[key]
        elif isinstance(here, list) and isinstance(key, int):
            here = here[key] if key < len(here) else None
        else:
            is_inside_text = isinstance(here, str) and key != "number"  # of a thruster event, and not a tag
            if not is_inside_text and not (detail["type"] == "missing" and key == detail["loc"][-1]):
                continue
        path.append(key)
    context = detail.get("ctx", {})
    given = context.get("keys", context.get("discriminator", "").strip("'")).split()
    candidates: list[KeyPath] = [(*path, key) for key in given if (*path, key) in layer.places]
    return min(candidates, key=lambda candidate: layer.place(candidate).depth, default=tuple(path))


def _texts(detail: ErrorDetails, path: KeyPath, model: Any) -> tuple[str, str | None]:
    """Return the problem and the remedy."""
    value, context = detail["input"], detail.get("ctx", {})
    match detail["type"]:
        case "wrong":
            return context["problem"], context["remedy"]
        case "missing":
            return "is missing", "add it"
        case "extra_forbidden":
            known = dict.fromkeys(_known_keys(model, path[:-1], detail["loc"]))
            return f"unknown key {shown(path[-1])}", did_you_mean(path[-1], known)
        case "literal_error" | "union_tag_invalid":
            allowed = re.findall(r"'([^']*)'", str(context.get("expected", context.get("expected_tags"))))
            word = context.get("tag", value)
            return f"{shown(word)} is not allowed", did_you_mean(word, allowed, "allowed")
        case "union_tag_not_found":
            return f"{context['discriminator'].strip(chr(39))} is missing", "add it"
        case "json_invalid" | "json_type":
            return f"{shown(value)} is not JSON", "write an object in JSON, as text"
        case "string_pattern_mismatch":
            return f"{shown(value)} is not a valid name", "use letters, digits, _ . and -, beginning with a letter"
    # Pydantic's own sentence, such as "Input should be a valid number", in the words of YAML.
    sentence = re.sub(
        r" or (instance of|object to) .*|, unable to .*| after validation|(?<=\ba) valid", "", detail["msg"]
    )
    for word, plain in (("a integer", "a whole number"), ("dictionary", "mapping"), ("tuple", "list")):
        sentence = sentence.replace(word, plain)
    return f"{shown(value)} {sentence.partition(' ')[2]}", None


def _known_keys(model: Any, path: KeyPath, loc: KeyPath) -> Iterator[str]:
    """The keys that a model has at a key path; of the members of a union, those of the one in pydantic's location."""
    for place, each in models_within(model):
        if len(place) == len(path) and all(part in (one, _ANY) for part, one in zip(place, path, strict=True)):
            tags = (each.model_fields[name].annotation for name in _TAGGED if name in each.model_fields)
            if all(typing.get_args(tag)[0] in loc for tag in tags):
                yield from each.model_fields
