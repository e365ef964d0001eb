"""Check a knowledge base before anything runs: rules, names, model, shapes, and what Pellet reports."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from decimal import Decimal
from itertools import islice
from typing import Final

from suave_des.errors import InputError, KnowledgeError
from suave_des.findings import Finding, Level, has_level, ordered
from suave_des.kb.shapes import check_shapes
from suave_des.kb.space import (
    component_statuses,
    has_effect,
    interchangeable_components,
    numbers_in,
    ranges_between,
)
from suave_des.knowledge.checks import Subject, static_findings
from suave_des.knowledge.checks.model import check_revision, rules_of_2023
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import collect
from suave_des.knowledge.pellet import ReasonerTimeoutError, TimeLimit
from suave_des.knowledge.reasoner import Reasoner, regions_of
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.monitor.diagnostics import RECOVERED

__all__ = ["MAX_STATES", "Subject", "check", "combined", "simple_states"]

#: States that Pellet is asked about; `kb policy` goes through all.
MAX_STATES: Final = 300


def check(subject: Subject) -> tuple[Finding, ...]:
    """Check a knowledge base.

    Pellet is asked at the end, even after an ERROR, unless it prevents the knowledge base from being loaded.

    Returns:
        all findings, the worst first.

    Raises:
        InputError: a file cannot be read at all.
    """
    sources = collect(subject.given)
    findings = static_findings(subject, sources)
    told = {(each.file, each.line) for each in findings if each.level is Level.ERROR}
    # A wrong value is told once, in the words of the one who cannot use it.
    findings += [each for each in check_shapes(sources, subject.shapes) if (each.file, each.line) not in told]
    return ordered([*findings, *_ask_pellet(subject, findings)])


def _ask_pellet(subject: Subject, before: Sequence[Finding]) -> Iterator[Finding]:
    """Use the knowledge base: this brings up contradictions, and rules that Pellet drops."""
    is_wrong = has_level(before, Level.ERROR)
    try:
        base = Ontology.load(
            subject.ontologies,
            values=subject.values,
            rules=subject.rules,
            disabled_rules=subject.disabled_rules,
            operators=subject.operators,
        )
    except KnowledgeError as error:
        message = "contradictions were not checked with Pellet: first correct the errors that prevent loading"
        yield Finding(Level.INFO, message) if is_wrong else Finding.of(error)
        return
    try:
        check_revision(base, subject.measured or (), subject.revision)
    except KnowledgeError:  # it is among the findings, and contradictions follow from it
        return
    for reason in regions_of(base).reasons:
        yield Finding(Level.INFO, f"inferences are cached for equal measured values only, which is slower: {reason}")
    try:
        # What is in its cache has been asked with this very knowledge base, without a contradiction or a dropped rule.
        pellet = Reasoner(base, "cached", TimeLimit(subject.time_limit_s, "--time-limit"))
        states = tuple(islice(simple_states(base, subject.measured), MAX_STATES)) or (KnowledgeState(),)
        try:
            for state in combined(states, apart=bool(rules_of_2023(base.content))):
                pellet.analyze(state)
        except ReasonerTimeoutError:
            raise
        except KnowledgeError:
            for state in states:  # the first that contradicts itself is the easiest to understand
                pellet.analyze(state)
            raise  # only a combination does
    except InputError as error:
        found = Finding.of(error)
        if found.rule not in {one.rule for one in before if one.rule and one.level is Level.ERROR}:
            yield found
        else:
            message = (
                f"contradictions were not checked with Pellet: it does not use rule {found.rule} until it is corrected"
            )
            yield Finding(Level.INFO, message)


def combined(states: Sequence[KnowledgeState], *, apart: bool = False) -> tuple[KnowledgeState, ...]:
    """Combine states that do not exclude one another: 45 instead of 186 for the shipped ontologies.

    A contradiction occurs in every state that contains it: Pellet's reasoning is monotonic.

    Args:
        states: the states.
        apart: whether recovered components are left in states of their own, because the rules of 2023 contradict any
            other problem then.
    """
    joined: list[tuple[dict[str, str], dict[str, str], dict[str, Decimal]]] = []
    for state in states:
        groundings, components, measurements = dict(state.groundings), dict(state.components), dict(state.measurements)
        for designs, reports, values in joined:
            if (
                not (apart and RECOVERED in {*components.values(), *reports.values()})
                and _agree(designs, groundings)
                and _agree(reports, components)
                and _agree(values, measurements)
            ):
                designs.update(groundings)
                reports.update(components)
                values.update(measurements)
                break
        else:
            joined.append((groundings, components, measurements))
    return tuple(
        KnowledgeState.of(map(ObjectiveState, designs), groundings=designs, components=reports, measurements=values)
        for designs, reports, values in joined
    )


def _agree(one: Mapping[str, object], other: Mapping[str, object]) -> bool:
    return all(one.get(name, value) == value for name, value in other.items())


def simple_states(base: Ontology, measured: Collection[str] | None = None) -> Iterator[KnowledgeState]:
    """Each design in use, alone, with a report of a component, and with a value in each range of each attribute.

    Only attributes that have an effect and, if those are given, are measured count, and one component of those that
    are treated alike.
    """
    ranges = ranges_between(numbers_in(base))
    reports = [{group[0]: status} for group in interchangeable_components(base) for status in component_statuses(base)]
    measurements = [
        {name: value}
        for name in base.quality_attributes
        if has_effect(base, name) and (measured is None or name in measured)
        for one in ranges
        if (value := one.value()) is not None
    ]
    for reported, values in (({}, {}), *((each, {}) for each in reports), *(({}, each) for each in measurements)):
        for function in base.functions:
            for design in base.designs(function):
                yield KnowledgeState.of(
                    [ObjectiveState(function)],
                    groundings={function: design},
                    components=reported,
                    measurements=values,
                )
