"""What `kb check` finds in the shipped ontology with something added."""

from __future__ import annotations

from pathlib import Path

import pytest

from suave_des.knowledge.checks.findings import Finding, Level
from suave_des.resources import shipped_folder
from suave_des.workbench.check import Subject, check

SUAVE = "http://www.metacontrol.org/suave#"
TOMASYS = "http://metacontrol.org/tomasys#"
OWL = "http://www.w3.org/2002/07/owl#"
SWRL = "http://www.w3.org/2003/11/swrl#"


def found(tmp_path: Path, rules: str = "", extra: str = "", states: int = 3, **options: object) -> tuple[Finding, ...]:
    """What is found in the shipped suave.owl with a rule file; Pellet is asked about a few states only."""
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    (tmp_path / "suave.owl").write_text(text.replace("</rdf:RDF>", extra + "</rdf:RDF>"), encoding="utf-8")
    (tmp_path / "mine.swrl").write_text(rules, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("suave_des.workbench.check.MAX_STATES", states)
        return check(Subject([tmp_path / "suave.owl"], [tmp_path / "mine.swrl"], **options))  # type: ignore[arg-type]


def errors(findings: tuple[Finding, ...]) -> list[Finding]:
    return [one for one in findings if one.level is Level.ERROR]


def only(findings: tuple[Finding, ...], words: str) -> Finding:
    (one,) = [finding for finding in findings if words in finding.message]
    return one


def individual(name: str, kind: str, inside: str = "") -> str:
    return (
        f'<owl:NamedIndividual rdf:about="{SUAVE}{name}"><rdf:type rdf:resource="{TOMASYS}{kind}"/>{inside}'
        "</owl:NamedIndividual>\n"
    )


def link(name: str, target: str) -> str:
    return f'<tomasys:{name} rdf:resource="{SUAVE}{target}"/>'
