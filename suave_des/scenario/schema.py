"""What the models of scenarios say: JSON Schema, and the meaning of each key."""

from __future__ import annotations

import ast
import inspect
import sys
from functools import cache
from itertools import pairwise
from typing import Any

from pydantic import BaseModel

from suave_des.files import Json
from suave_des.scenario.models import Scenario
from suave_des.scenario.yamlfile import models_within

_EVENT_TEXT = r"^\s*\(\s*[1-6]\s*,\s*(failure|recovery)\s*,[^,]+\)\s*$"


def scenario_schema() -> Json:
    """JSON Schema (draft 2020-12) of a scenario file.

    What a mapping needs may stand in the base that it differs from: the loader alone checks that,
    and relations between values, such as a minimum that must not be above its maximum.
    """
    whole = Scenario.model_json_schema()
    definitions: Json = whole.pop("$defs")
    definitions["Scenario"] = whole
    for model in dict.fromkeys(model for _, model in models_within(Scenario)):
        for name, text in field_docs(model).items():
            definitions[model.__name__]["properties"][name]["description"] = text
    definitions = {name: _partial(definition) for name, definition in definitions.items()}
    event = {"anyOf": [definitions["ThrusterEvent"], {"type": "string", "pattern": _EVENT_TEXT}]}
    definitions["ThrusterEvent"] = event
    for named in ("signals", "default_modes"):
        definitions["Scenario"]["properties"][named]["additionalProperties"] = (
            False  # other names than are allowed
        )
    # over a base, a null removes an entry
    for name, key in (
        ("Scenario", "signals"),
        ("KnowledgeSettings", "values"),
    ):
        entries = definitions[name]["properties"][key]
        allowed = entries.get("patternProperties", entries)
        for each in ("additionalProperties",) if allowed is entries else tuple(allowed):
            allowed[each] = {"anyOf": [allowed[each], {"type": "null"}]}
    base = {"type": ["string", "number"], "description": "Name or path of what this differs from."}
    for key, model_name in (("revision", "Revision"), ("vehicle", "VehicleDescription")):
        definitions[model_name]["properties"]["base"] = base
        part = definitions["Scenario"]["properties"][key]
        definitions["Scenario"]["properties"][key] = {
            "anyOf": [base, part],
            "description": part["description"],
        }
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
        for field, text in pairwise(_classes(part.__module__)[part.__name__].body):
            match field, text:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(
                    value=ast.Constant(value=str(meaning))
                ):
                    texts[name] = inspect.cleandoc(meaning)
    return texts


@cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    """The definitions of a module's classes, whose source is parsed once for all of them."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
