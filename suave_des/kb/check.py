"""Check a knowledge base before anything runs: rules, names, model, shapes (SHACL), and what Pellet reports."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict
from decimal import Decimal
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import Final

from rdflib import RDF, Graph, Namespace, URIRef
from rdflib.plugins.parsers.notation3 import BadSyntax
from rdflib.term import Node

from suave_des.caches import private_cache, read_checked, remove_oldest, with_checksum
from suave_des.errors import InputError, KnowledgeError
from suave_des.files import decode, read_bytes
from suave_des.findings import Finding, Level, has_level, ordered
from suave_des.kb.space import (
    Scale,
    component_statuses,
    has_effect,
    interchangeable_components,
    numbers_in,
)
from suave_des.knowledge.checks import Subject, static_findings
from suave_des.knowledge.checks.model import check_revision, rules_of_2023
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import OntologyFile, collect, place_of
from suave_des.knowledge.pellet import ReasonerTimeoutError, TimeLimit
from suave_des.knowledge.rdf import HAS_VALUE, local_name, without_log
from suave_des.knowledge.reasoner import Reasoner, regions_of
from suave_des.knowledge.state import KnowledgeState, ObjectiveState, measurement_name
from suave_des.monitor.diagnostics import RECOVERED
from suave_des.resources import shipped_folder

__all__ = ["MAX_STATES", "Subject", "check", "combined", "simple_states"]

#: States that Pellet is asked about; `kb policy` goes through all.
MAX_STATES: Final = 300
_SH: Final = Namespace("http://www.w3.org/ns/shacl#")
_REASON: Final = re.compile(r"Bad syntax \((.*?)\) at \^ in:", re.DOTALL)
_LEVELS: Final = {_SH.Violation: Level.ERROR, _SH.Warning: Level.WARN, _SH.Info: Level.INFO}
_TURTLE: Final = "give SHACL shapes in Turtle"
_SHAPES_LIMIT_BYTES: Final = 8 * 2**20


def check(subject: Subject) -> tuple[Finding, ...]:
    """Check a knowledge base.

    Pellet is asked at the end, even after an ERROR, unless it prevents the knowledge base from being loaded.

    Returns:
        all findings, the worst first.

    Raises:
        InputError: a file cannot be read at all.
    """
    sources = collect(subject.given)
    findings = [*static_findings(subject, sources), *check_shapes(sources, subject.shapes)]
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
    scale = Scale(numbers_in(base))
    reports = [{group[0]: status} for group in interchangeable_components(base) for status in component_statuses(base)]
    measurements = [
        {name: value}
        for name in base.quality_attributes
        if has_effect(base, name) and (measured is None or name in measured)
        for place in range(1, len(scale))
        if (value := scale.value(place)) is not None
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


def check_shapes(sources: Sequence[OntologyFile], more: Sequence[Path] = ()) -> list[Finding]:
    """Check the model against SHACL shapes, the shipped ones and more; the same files are checked once, then cached.

    Args:
        sources: the ontologies.
        more: files of shapes.

    Raises:
        InputError: a file of shapes cannot be read.
    """
    files = (shipped_folder("ontology") / "tomasys-shapes.ttl", *more)
    texts = [decode(path, read_bytes(path, _SHAPES_LIMIT_BYTES)) for path in files]
    total = hashlib.sha256(f"{version('pyshacl')}{Path(__file__).read_bytes()!r}{texts}".encode())
    for source in sources:
        total.update(str(source.path).encode() + hashlib.sha256(source.content).digest())
    folder = private_cache("findings")
    path = None if folder is None else folder / total.hexdigest()
    if path is not None and (content := read_checked(path)) is not None:
        return [Finding(**each | {"level": Level(each["level"])}) for each in json.loads(content)]
    shapes = Graph()
    for file, text in zip(files, texts, strict=True):
        shapes += _read_shapes(file, text)
    found = list(_validate(sources, shapes, more))
    if path is not None:
        path.write_bytes(with_checksum(json.dumps([asdict(each) for each in found]).encode()))
        remove_oldest(path.parent, "*")
    return found


def _validate(sources: Sequence[OntologyFile], shapes: Graph, files: Sequence[Path]) -> Iterator[Finding]:
    from pyshacl import validate

    data = Graph()
    for source in sources:
        data += source.graph
    try:
        _, report, _ = validate(data, shacl_graph=shapes, do_owl_imports=False, meta_shacl=False, inplace=False)
        if not isinstance(report, Graph):
            raise ValueError(getattr(report, "message", report))
    except Exception as error:  # each kind of malformed shape raises another error
        reason = " ".join(str(error).split())
        raise InputError(f"the shapes cannot be used: {reason}", file=", ".join(map(str, files)) or None) from error
    for result in report.subjects(_SH.resultSeverity, None):
        # A query (SPARQL) is about the value that it gives, other constraints are about their focus.
        is_query = report.value(result, _SH.sourceConstraintComponent) == _SH.SPARQLConstraintComponent
        thing = (report.value(result, _SH.value) if is_query else None) or report.value(result, _SH.focusNode)
        if is_query or not _is_placeholder(thing, data):
            yield _finding(report, result, thing, sources)


def _is_placeholder(node: Node | None, data: Graph) -> bool:
    """Whether an individual has nothing but a class, and nothing refers to it, so that it has no effect."""
    is_mentioned = any(predicate != RDF.type for predicate in data.predicates(node, None))
    return isinstance(node, URIRef) and not is_mentioned and (None, None, node) not in data


def _read_shapes(path: Path, text: str) -> Graph:
    if text.lstrip().startswith(("<?xml", "<rdf:RDF")):
        raise InputError("this is XML, not Turtle", file=path, remedy=_TURTLE)
    place = None
    try:
        with without_log():
            return Graph().parse(data=text, format="turtle")
    except BadSyntax as error:
        found = _REASON.search(str(error))
        reason, place = found.group(1) if found else "bad syntax", f"line {error.lines + 1}"
    except Exception as error:  # the parser meets the end of a truncated file in many ways
        reason = "it ends too early" if isinstance(error, IndexError) else " ".join(str(error).split())[:200]
    raise InputError(f"is not Turtle: {reason}", file=path, place=place, remedy=_TURTLE)


def _finding(report: Graph, result: Node, thing: Node | None, sources: Sequence[OntologyFile]) -> Finding:
    name, path = local_name(str(thing)), report.value(result, _SH.resultPath)
    level = _LEVELS.get(URIRef(str(report.value(result, _SH.resultSeverity))), Level.ERROR)
    words = (name, local_name(str(path or "")), str(report.value(result, _SH.resultMessage) or ""))
    message = ": ".join(filter(None, words))
    has_value = any((thing, URIRef(HAS_VALUE), None) in source.graph for source in sources)
    if path == URIRef(HAS_VALUE) and name.startswith(measurement_name("")) and not has_value:
        level, message = Level.INFO, f"{name} has no hasValue: missions give it the measured one"
    described = [source for source in sources if source.line_of(name)]
    mentioning = [source for source in sources if thing in source.graph.all_nodes()]
    file, line = place_of(name, described or mentioning or sources)
    return Finding(level, message, str(file), line)
