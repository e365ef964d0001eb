"""kb check: edits of an ontology that mean something else than was wanted."""

from __future__ import annotations

from pathlib import Path

import pytest

from suave_des.knowledge.checks.findings import Finding, Level
from suave_des.knowledge.checks.static import Subject, static_findings
from suave_des.knowledge.ontology_file import collect
from suave_des.monitor.diagnostics import REPORTED_STATUSES
from suave_des.workbench.shapes import check_shapes

SUAVE = "http://www.metacontrol.org/suave#"
TOMASYS = "http://metacontrol.org/tomasys#"
MODES = {"f_follow_pipeline": ["fd_follow_pipeline", "quick"]}


def thing(name: str, kind: str = "", inside: str = "") -> str:
    """An individual; without a kind, only declared."""
    kind = f'<rdf:type rdf:resource="{TOMASYS}{kind}"/>' if kind else ""
    return f'<owl:NamedIndividual rdf:about="{SUAVE}{name}">{kind}{inside}</owl:NamedIndividual>'


def link(name: str, target: str) -> str:
    return f'<tomasys:{name} rdf:resource="{SUAVE}{target}"/>'


def value(name: str, text: str, kind: str = "decimal") -> str:
    return f'<tomasys:{name} rdf:datatype="http://www.w3.org/2001/XMLSchema#{kind}">{text}</tomasys:{name}>'


def same(name: str) -> str:
    return f'<owl:sameAs rdf:resource="{SUAVE}{name}"/>'


def subclass(name: str, kind: str) -> str:
    below = f'<rdfs:subClassOf rdf:resource="{TOMASYS}{kind}"/>'
    return f'<owl:Class rdf:about="{SUAVE}{name}">{below}</owl:Class>'


def warned(edited, extra: str, **options) -> list[Finding]:
    """The warnings about a suave.owl with something added, without those that the checks of designs give."""
    path: Path = edited(extra)
    settings = {"modes": MODES, "reported": REPORTED_STATUSES, "measured": ["water_visibility"]} | options
    found = static_findings(Subject([path], **settings), collect([path])).findings
    return [each for each in found if each.level is not Level.INFO and "mode" not in each.message]


ESTIMATE = thing("fd_spiral_low", inside=link("hasQAestimation", "qa_mine"))
WRONG = {
    "designs made the same": (
        thing("fd_spiral_low", inside=same("fd_spiral_high")),
        "fd_spiral_low is the same as fd_spiral_high (sameAs), so what holds of one holds of both",
    ),
    "functions made the same": (
        thing("f_follow_pipeline", inside=same("f_maintain_motion")),
        "f_follow_pipeline is the same as f_maintain_motion (sameAs), so what holds of one holds of both",
    ),
    "design as class": (
        subclass("fd_quick", "FunctionDesign"),
        "fd_quick is a class without members; a FunctionDesign is an individual",
    ),
    "design as class, by its mode": (
        subclass("quick", "FunctionDesign"),
        "quick is a class without members; a FunctionDesign is an individual",
    ),
    "class named like a design": (
        f'<owl:Class rdf:about="{SUAVE}fd_spiral_low"/>',
        "fd_spiral_low is the name of a class and of an individual",
    ),
    "individual named like a class": (
        thing("Component", "Component"),
        "Component is the name of a class and of an individual",
    ),
    "two estimates": (
        thing("qa_mine", "QAvalue", link("isQAtype", "water_visibility") + value("hasValue", "2.5")) + ESTIMATE,
        "fd_spiral_low expects several values of water_visibility: qa_mine (2.5) and qa_water_visibility_low (1.25);"
        " the planner uses the least",
    ),
    "no class": (thing("fd_new"), "fd_new has no class, so it means nothing"),
    "status as truth value": (
        thing("c_thruster_1", inside=value("c_status", "false", "boolean")),
        'c_status of c_thruster_1 is false, but missions and rules have "FALSE"',
    ),
    "measured value that is not measured": (
        thing("obs_current", "QAvalue", value("hasValue", "2.5"))
        + thing("current", "QualityAttributeType", value("qa_comparison_operator", "&lt;", "string")),
        "hasValue of obs_current is not used: current has the value that missions measure",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_an_edit_that_means_something_else(case: str, edited) -> None:
    extra, message = WRONG[case]
    (finding,) = warned(edited, extra)
    assert (finding.level, finding.message) == (Level.WARN, message)
    assert finding.line is not None


@pytest.mark.parametrize(
    "extra",
    [
        "",
        thing("c_thruster_7", "Component", same("c_thruster_1")),
        subclass("SearchDesign", "FunctionDesign"),
        subclass("fd_quick", "FunctionDesign")
        + thing("fd_follow_pipeline", inside=f'<rdf:type rdf:resource="{SUAVE}fd_quick"/>'),
        thing("qa_mine", "QAvalue", link("isQAtype", "water_visibility") + value("hasValue", "1.25")) + ESTIMATE,
        thing("fd_spiral_low", inside="<rdfs:comment>no facts</rdfs:comment>"),
        thing("c_thruster_1", inside=value("c_status", "FALSE", "string")),
        thing("c_thruster_1", inside=value("c_status", "worn", "string")),
        thing("obs_water_visibility", "QAvalue", value("hasValue", "2.5")),
    ],
)
def test_right_edits(extra: str, edited) -> None:
    assert not warned(edited, extra)


def test_a_comparison_operator_with_and_without_its_datatype(edited) -> None:
    def problems(operator: str) -> list[str]:
        found = check_shapes(collect([edited(thing("current", "QualityAttributeType", operator))]), (), {})
        return [each.message for each in found if each.level is Level.ERROR]

    assert not problems(value("qa_comparison_operator", "&gt;=", "string"))
    assert not problems("<tomasys:qa_comparison_operator>&lt;</tomasys:qa_comparison_operator>")
    assert problems(value("qa_comparison_operator", "==", "string"))
