"""JSON Schema of scenario files, for editors and other tools, and the meaning of each key."""

from __future__ import annotations

import ast
import inspect
import sys
from functools import cache
from typing import Any

from pydantic import BaseModel

from suave_des.scenario.models import Scenario
from suave_des.scenario.problems import models_within

_PARTIAL = "Partial"
_REFERENCE = "#/$defs/"
_EVENT_TEXT = r"^\s*\(\s*[1-6]\s*,\s*(failure|recovery)\s*,[^,]+\)\s*$"


def scenario_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a scenario file.

    A file with `base` may give any part of a scenario; one without must give what has no default. Relations between
    values, such as a minimum that must not be above its maximum, are checked by the loader only.
    """
    whole = Scenario.model_json_schema(ref_template=_REFERENCE + "{model}")
    definitions: dict[str, Any] = whole.pop("$defs")
    definitions["Scenario"] = whole
    for named in ("signals", "default_modes"):
        whole["properties"][named]["additionalProperties"] = False  # of other names than the pattern allows
    _describe(definitions)
    definitions["ThrusterEvent"] = {"anyOf": [definitions["ThrusterEvent"], {"type": "string", "pattern": _EVENT_TEXT}]}
    definitions |= {_PARTIAL + name: _partial(definition) for name, definition in definitions.items()}
    _allow_removal(definitions)
    _allow_bases(definitions)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "suave-des scenario",
        "if": {"required": ["base"]},
        "then": {"$ref": f"{_REFERENCE}{_PARTIAL}Scenario"},
        "else": {"$ref": f"{_REFERENCE}Scenario"},
        "$defs": definitions,
    }


def _describe(definitions: dict[str, Any]) -> None:
    for model in {model: None for _, model in models_within(Scenario)}:
        for name, text in field_docs(model).items():
            definitions[model.__name__]["properties"][name]["description"] = text


def _partial(schema: Any) -> Any:
    """The same schema with nothing required, referring to definitions of which the same holds."""
    if isinstance(schema, list):
        return [_partial(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    partial = {
        key: _partial(value)
        for key, value in schema.items()
        if key not in ("required", "oneOf", "$ref", "discriminator")
    }
    if "oneOf" in schema:  # without what is required, a mapping may fit several members
        partial["anyOf"] = _partial(schema["oneOf"])
    if "$ref" in schema:
        partial["$ref"] = schema["$ref"].replace(_REFERENCE, _REFERENCE + _PARTIAL)
    return partial


def _allow_removal(definitions: dict[str, Any]) -> None:
    """Over a base, a null removes a signal or a replaced value."""
    for name, key in (("Scenario", "signals"), ("KnowledgeSettings", "values")):
        entries = definitions[_PARTIAL + name]["properties"][key]
        names = entries.get("patternProperties", {})
        for pattern, entry in names.items():
            names[pattern] = {"anyOf": [entry, {"type": "null"}]}
        if not names:
            entries["additionalProperties"] = {"anyOf": [entries["additionalProperties"], {"type": "null"}]}


def _allow_bases(definitions: dict[str, Any]) -> None:
    """A scenario, a revision and a vehicle may name what they build on; the last two may be no more than their name."""
    names = {"type": ["string", "number"]}
    for key, model in (("revision", "Revision"), ("vehicle", "VehicleDescription")):
        base = {**names, "description": f"Name or path of the {key} that this one differs from."}
        over = {**definitions[_PARTIAL + model], "required": ["base"]}
        over["properties"] = {"base": base, **over["properties"]}
        definitions[f"{model}OverBase"] = over
        forms = [names, {"$ref": f"{_REFERENCE}{model}OverBase"}, {"$ref": f"{_REFERENCE}{model}"}]
        for scenario, extra in (("Scenario", []), ("PartialScenario", [{"$ref": f"{_REFERENCE}{_PARTIAL}{model}"}])):
            properties = definitions[scenario]["properties"]
            properties[key] = {"anyOf": [*forms, *extra], "description": properties[key]["description"]}
    definitions["Scenario"]["required"].remove("vehicle")  # left out, it is the shipped one
    definitions["Scenario"]["required"].remove("name")  # left out, it is the file's name
    definitions["PartialScenario"]["properties"]["base"] = {
        "type": "string",
        "description": "Scenario that this one differs from.",
    }


def field_docs(model: type[BaseModel]) -> dict[str, str]:
    """What each field of a model means: the text under it in the source."""
    texts: dict[str, str] = {}
    for part in reversed(model.__mro__):
        if part is BaseModel or not issubclass(part, BaseModel):
            continue
        definition = _classes(part.__module__)[part.__name__]
        for field, text in zip(definition.body, definition.body[1:], strict=False):
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
