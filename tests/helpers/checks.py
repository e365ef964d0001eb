"""What is found in the shipped ontology with something added."""

from __future__ import annotations

from pathlib import Path

from suave_des.errors import Finding, Level, ordered
from suave_des.kb.check import check, check_shapes
from suave_des.knowledge.checks import Subject, static_findings
from suave_des.knowledge.resolver import collect
from suave_des.resources import shipped_folder

SUAVE = "http://www.metacontrol.org/suave#"
TOMASYS = "http://metacontrol.org/tomasys#"
OWL = "http://www.w3.org/2002/07/owl#"
SWRL = "http://www.w3.org/2003/11/swrl#"


def subject(tmp_path: Path, rules: str = "", extra: str = "", **options: object) -> Subject:
    """A copy of the shipped suave.owl with things added at its end, and a file of rules."""
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    (tmp_path / "suave.owl").write_text(
        text.replace("</rdf:RDF>", extra + "</rdf:RDF>"), encoding="utf-8"
    )
    (tmp_path / "mine.swrl").write_text(rules, encoding="utf-8")
    return Subject([tmp_path / "suave.owl"], [tmp_path / "mine.swrl"], **options)  # type: ignore[arg-type]


def found_by_pellet(
    tmp_path: Path, rules: str = "", extra: str = "", **options: object
) -> tuple[Finding, ...]:
    """What `kb check` finds."""
    return check(subject(tmp_path, rules, extra, **options))


def found(
    tmp_path: Path, rules: str = "", extra: str = "", **options: object
) -> tuple[Finding, ...]:
    """What `kb check` finds without a reasoner."""
    return findings_of(subject(tmp_path, rules, extra, **options))


def findings_of(subject: Subject) -> tuple[Finding, ...]:
    """What `kb check` finds without a reasoner."""
    sources = collect(subject.ontologies)
    return ordered([*static_findings(subject, sources), *check_shapes(sources.files)])


def errors(findings: tuple[Finding, ...]) -> list[Finding]:
    return [one for one in findings if one.level is Level.ERROR]


def warnings(findings: tuple[Finding, ...]) -> list[Finding]:
    return [one for one in findings if one.level is Level.WARN]


def only(findings: tuple[Finding, ...], words: str) -> Finding:
    (one,) = [finding for finding in findings if words in finding.message]
    return one


def individual(name: str, kind: str = "", inside: str = "") -> str:
    """An individual; without a kind, only declared."""
    kind = f'<rdf:type rdf:resource="{TOMASYS}{kind}"/>' if kind else ""
    return f'<owl:NamedIndividual rdf:about="{SUAVE}{name}">{kind}{inside}</owl:NamedIndividual>\n'


def link(name: str, target: str) -> str:
    return f'<tomasys:{name} rdf:resource="{SUAVE}{target}"/>'


def value(name: str, text: str, kind: str = "decimal") -> str:
    return f'<tomasys:{name} rdf:datatype="http://www.w3.org/2001/XMLSchema#{kind}">{text}</tomasys:{name}>'
