"""Write docs/reference/scenario.md from the scenario's models: python docs/make_scenario_reference.py."""

from __future__ import annotations

import json
import types
import typing
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from suave_des.scenario.models import ManagerSettings, Scenario
from suave_des.scenario.physical import VehicleDescription
from suave_des.scenario.quantities import LONGEST_S, Choice, Exponential, Normal, Uniform
from suave_des.scenario.revision import Revision
from suave_des.scenario.schema import field_docs
from suave_des.scenario.signal_kinds import ConstantSignal, SinusoidSignal, StepSignal, TableSignal

PAGE = Path(__file__).parent / "reference" / "scenario.md"
SIGNALS = (SinusoidSignal, ConstantSignal, StepSignal, TableSignal)
DISTRIBUTIONS = (Normal, Uniform, Exponential, Choice)
UNITS = (  # ending of a key: its unit; the first that fits
    ("_m_per_s", "m/s"),
    ("_per_s", "1/s"),
    ("_rad", "rad"),
    ("_deg", "degrees"),
    ("_kg_per_m3", "kg/m^3"),
    ("_kg_m2", "kg m^2"),
    ("_kg", "kg"),
    ("_m3", "m^3"),
    ("_n", "N"),
    ("_s", "s"),
    ("_m", "m"),
)
BOUNDS = (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<="))


def page() -> str:
    """The whole page."""
    text = (Path(__file__).parent / "reference" / "scenario.md.in").read_text(encoding="utf-8")
    tables = {
        "scenario": table(Scenario),
        "parts": parts(Scenario, "", {Revision, VehicleDescription, ManagerSettings, *SIGNALS, *DISTRIBUTIONS}),
        "signals": "\n".join(f"### kind: {kind(each, 'kind')}\n\n{lead(each)}\n\n{table(each)}" for each in SIGNALS),
        "distributions": "\n".join(
            f"### distribution: {kind(each, 'distribution')}\n\n{lead(each)}\n\n{table(each)}" for each in DISTRIBUTIONS
        ),
        "managers": parts(ManagerSettings, "managers.", set()),
        "revision": table(Revision) + "\n" + parts(Revision, "revision.", set(DISTRIBUTIONS)),
        "vehicle": table(VehicleDescription) + "\n" + parts(VehicleDescription, "vehicle.", set()),
    }
    for name, content in tables.items():
        text = text.replace(f"<!-- {name} -->\n", content)
    return text


def parts(model: type[BaseModel], prefix: str, apart: set[type[BaseModel]]) -> str:
    """A heading and a table for each mapping within a model."""
    sections = []
    for name, field in model.model_fields.items():
        inner = [each for each in models_in(field.annotation) if each not in apart]
        for each in inner:
            suffix = "[]" if typing.get_origin(field.annotation) is tuple else ""
            sections.append(f"### {prefix}{name}{suffix}\n\n{lead(each)}\n\n{table(each)}")
            if each is not VehicleDescription and (below := parts(each, f"{prefix}{name}.", apart)):
                sections.append(below)
    return "\n".join(sections)


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """Models that an annotation names itself."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [each for argument in typing.get_args(annotation) for each in models_in(argument)]


def lead(model: type[BaseModel]) -> str:
    """What a model is, from its docstring, as one paragraph."""
    return " ".join((model.__doc__ or "").split())


def kind(model: type[BaseModel], key: str) -> str:
    """The word that distinguishes a model from its siblings."""
    return str(typing.get_args(model.model_fields[key].annotation)[0])


def table(model: type[BaseModel]) -> str:
    """A Markdown table of a model's keys."""
    docs = field_docs(model)
    rows = ["| key | value | unit | default | meaning |", "| --- | --- | --- | --- | --- |"]
    for name, field in model.model_fields.items():
        meaning = " ".join(docs[name].split()).replace("|", "\\|")
        rows.append(f"| `{name}` | {value_text(field)} | {unit(name)} | {default_text(field)} | {meaning} |")
    return "\n".join(rows) + "\n"


def unit(name: str) -> str:
    """Unit of a key, by its ending."""
    return next((text for ending, text in UNITS if name.endswith(ending)), "")


def value_text(field: FieldInfo) -> str:
    """What a key takes, in words."""
    return type_text(field.annotation) + bounds_text(field.metadata)


def bounds_text(marks: Iterable[Any]) -> str:
    """A number's bounds, such as " > 0 and <= 6", without those that the page gives once for all."""
    found = [(sign, getattr(mark, key, None)) for mark in marks for key, sign in BOUNDS]
    bounds = [f"{sign} {bound:g}" for sign, bound in found if bound is not None and abs(bound) < LONGEST_S]
    return " " + " and ".join(bounds) if bounds else ""


def type_text(annotation: Any) -> str:
    """A type in the words of the page."""
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if set(models_in(annotation)) >= set(DISTRIBUTIONS) and origin in (typing.Union, types.UnionType):
        return "number or [distribution](#distributions)"
    if origin is not dict and set(models_in(annotation)) == set(SIGNALS):
        return "[signal](#signals)"
    if annotation in (float, int, str, bool):
        return {float: "number", int: "whole number", str: "text", bool: "true or false"}[annotation]
    if origin is typing.Literal:
        return " or ".join(f"`{each}`" for each in arguments)
    if origin is typing.Annotated:
        return type_text(arguments[0]) + bounds_text(arguments[1:])
    if origin in (typing.Union, types.UnionType):
        return " or ".join(type_text(each) for each in arguments if each is not type(None))
    if origin is tuple:
        return f"list of {type_text(arguments[0])}"
    if origin is dict:
        return f"mapping of name to {type_text(arguments[1])}"
    return "mapping"


def default_text(field: FieldInfo) -> str:
    """A key's default as it would be written in YAML."""
    if field.is_required():
        return "needed"
    value = field.get_default(call_default_factory=True, validated_data={})
    if value is None:
        return "none"
    if isinstance(value, BaseModel):
        return "as below"
    if value is PydanticUndefined:
        raise ValueError("a key without default is needed")
    return f"`{json.dumps(value)}`" if value not in ("", (), {}) else "empty"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
