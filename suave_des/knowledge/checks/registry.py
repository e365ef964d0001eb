"""The registry of checks that need no reasoner, and what they look at.

A check is a function that yields what is wrong: with what (a rule, or the thing of a name), where in the rule, in
words, and what would be right, if that is known. Its level is that for the user's own files: what is suspicious in a
rule of an imported ontology is a note. `kb check` adds the shapes of the model (SHACL), and what Pellet says.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property
from pathlib import Path
from typing import Final

from suave_des.findings import Finding, Level
from suave_des.knowledge.content import Content
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import is_metamodel, place_of
from suave_des.knowledge.pellet import TIME_LIMIT_S
from suave_des.knowledge.rdf import OWL, RDF_TYPE
from suave_des.knowledge.rules import Place, Rule
from suave_des.knowledge.rules.checks import about_rule
from suave_des.resources import shipped_folder


@dataclass(frozen=True)
class Subject:
    """What to check.

    Attributes:
        ontologies: files; without any, the shipped suave.owl.
        rules: files of rules as text.
        disabled_rules: names of rules to disable.
        values: replaces the hasValue of named QAvalue individuals.
        modes: names of the modes by function; None skips the checks against them.
        needed: functions that the mission cannot do without.
        operators: qa_comparison_operator that the revision assumes of quality attribute types that have none, by name.
        revision: the scenario's, for messages.
        reported: the statuses that the simulation reports, by component; None: that is not checked.
        measured: the quality attributes that the scenario measures; None: that is not checked.
        reaction_thresholds_m: visibilities by which the mean reaction time is judged; None: that is not checked.
        time_limit_s: for Pellet.
    """

    ontologies: Sequence[Path] = ()
    rules: Sequence[Path] = ()
    disabled_rules: Collection[str] = ()
    values: Mapping[str, Decimal] = field(default_factory=dict)
    modes: Mapping[str, Collection[str]] | None = None
    needed: Collection[str] = ()
    operators: Mapping[str, str] = field(default_factory=dict)
    revision: str = ""
    reported: Mapping[str, Collection[str]] | None = None
    measured: Collection[str] | None = None
    reaction_thresholds_m: Collection[float] | None = None
    time_limit_s: float = TIME_LIMIT_S

    @property
    def given(self) -> list[Path]:
        """The ontologies, or the shipped one."""
        return list(self.ontologies) or [shipped_folder("ontology") / "suave.owl"]


@dataclass(frozen=True, eq=False)
class Material:
    """What checks look at.

    Attributes:
        subject: what is to be checked.
        base: the ontologies and rules, with the operators that the revision assumes.
    """

    subject: Subject
    base: Ontology

    @cached_property
    def content(self) -> Content:
        """All that the files state, that which only holds in states, too."""
        return replace(self.base.content, triples=tuple(dict.fromkeys((*self.base.content.triples, *self.base.stated))))

    @cached_property
    def rules(self) -> tuple[Rule, ...]:
        """The enabled rules."""
        return self.content.enabled_rules

    @cached_property
    def functional(self) -> frozenset[str]:
        """The properties that have one value only."""
        kind = (RDF_TYPE, OWL + "FunctionalProperty")
        return frozenset(subject for subject, name, value in self.content.triples if (name, value) == kind)

    def is_own(self, rule: Rule) -> bool:
        """Whether a rule is in a file that the user gave, and that is not TOMASys, which has rules for any model."""
        source, given = self.base.source_of(rule), (*self.subject.given, *self.subject.rules)
        return rule.file.resolve() in {path.resolve() for path in given} and not (source and is_metamodel(source))

    def finding(self, level: Level, found: Found) -> Finding:
        """Make a finding of what a check yields."""
        what, place, message, remedy = found
        if isinstance(what, Path):
            return Finding(level, message, str(what), remedy=remedy)
        if isinstance(what, str):
            file, line = place_of(what, self.base.sources)
            return Finding(level, message, str(file), line, remedy=remedy)
        if level is Level.WARN and not self.is_own(what):
            level = Level.INFO
        return about_rule(what, message, place, remedy, level, self.base.place_of(what))


#: With what something is wrong (a rule, a thing by its name, a file), where in the rule, in words, and the remedy.
Found = tuple[Rule | str | Path, Place | None, str, str | None]
Check = Callable[[Material], Iterable[Found]]
CHECKS: Final[list[tuple[Level, Check]]] = []


def check(level: Level) -> Callable[[Check], Check]:
    """Add a function to the checks.

    @check(Level.WARN)
    def no_effect(material: Material) -> Iterator[Found]:
        for rule in material.rules:
            ...
    """

    def register(function: Check) -> Check:
        CHECKS.append((level, function))
        return function

    return register


def run_checks(material: Material) -> Iterator[Finding]:
    """Run all checks."""
    return (material.finding(level, found) for level, function in CHECKS for found in function(material))
