"""Check a knowledge base before anything runs: rules, names, model, shapes (SHACL), and what Pellet
reports.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict
from decimal import Decimal
from importlib.metadata import version
from itertools import chain
from pathlib import Path

from rdflib import RDF, BNode, Graph, Namespace, URIRef
from rdflib.term import Node

from suave_des.caches import SharedEntries, private_cache
from suave_des.errors import (
    Finding,
    InputError,
    KnowledgeError,
    Level,
    has_level,
    ordered,
    relative_path,
)
from suave_des.kb.space import PolicySpace, spread
from suave_des.kb.states import ManagingSettings
from suave_des.knowledge.checks import (
    Subject,
    check_revision,
    findings_in,
    rules_of_2023,
    static_findings,
)
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import OntologyFile, place_of
from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.pellet.in_process import ignored_axioms, pattern_problem
from suave_des.knowledge.rdf import HAS_VALUE, SWRLB, Lit, local_name
from suave_des.knowledge.reasoner import Reasoner, regions_of
from suave_des.knowledge.resolver import collect
from suave_des.knowledge.rules.files import about_rule
from suave_des.knowledge.state import KnowledgeState, ObjectiveState, measurement_name
from suave_des.monitor.diagnostics import RECOVERED
from suave_des.resources import shipped_folder

#: States that Pellet is asked about; `kb policy` goes through all.
MAX_STATES = 300
#: The same times the rules, each of which Pellet reads anew for a state: some seconds in all.
_MAX_RULES_READ = 5_000
_SH = Namespace("http://www.w3.org/ns/shacl#")
_LEVELS = {_SH.Violation: Level.ERROR, _SH.Warning: Level.WARN, _SH.Info: Level.NOTE}


def check(subject: Subject) -> tuple[Finding, ...]:
    """Check a knowledge base.

    Pellet is asked at the end, even after an ERROR, unless it prevents the knowledge base from
    being loaded.

    Returns:
        all findings, the worst first.

    Raises:
        InputError: a file cannot be read at all.
    """
    try:
        base = Ontology.load(
            subject.ontologies,
            values=subject.values,
            rules=subject.rules,
            disabled_rules=subject.disabled_rules,
            operators=subject.operators,
        )
    except KnowledgeError as error:
        sources = collect(subject.ontologies)
        findings = [*static_findings(subject, sources), *check_shapes(sources.files)]
        message = "contradictions were not checked with Pellet: first correct the errors that prevent loading"
        is_known = has_level(findings, Level.ERROR)
        return ordered([*findings, Finding(Level.NOTE, message) if is_known else Finding.of(error)])
    findings = [*findings_in(base, subject), *check_shapes(base.sources)]
    return ordered([*findings, *_wrong_patterns(base), *_ask_pellet(subject, base, findings)])


#: Which argument of a built-in is a pattern.
_PATTERN = {SWRLB + "matches": 1, SWRLB + "replace": 2, SWRLB + "tokenize": 2}


def _wrong_patterns(base: Ontology) -> Iterator[Finding]:
    """Find the patterns in rules that are none for Java, so that they match nothing."""
    for rule in base.content.enabled_rules:
        for atom in rule.body:
            number = _PATTERN.get(atom.predicate, len(atom.arguments))
            for pattern in atom.arguments[number : number + 1]:
                if isinstance(pattern, Lit) and (problem := pattern_problem(pattern.text)):
                    words = f"{pattern.text!r} is not a pattern, and matches nothing: {problem}"
                    yield about_rule(rule, words, atom.place(number), None, Level.WARN)


def _ask_pellet(subject: Subject, base: Ontology, before: Sequence[Finding]) -> Iterator[Finding]:
    """Use the knowledge base: this brings up contradictions, and rules that Pellet drops."""
    try:
        check_revision(base, subject.measured or (), subject.revision)
    except KnowledgeError:  # it is among the findings, and contradictions follow from it
        return
    for reason in regions_of(base).reasons:
        slower = "a mission whose values never repeat takes a second or so, not milliseconds"
        words = f"inferences are cached for equal measured values only ({slower}): {reason}"
        yield Finding(Level.NOTE, words)
    try:
        # What is in its cache has been asked with this very knowledge base, without a contradiction
        # or a dropped rule.
        pellet = Reasoner(base, "cached", TimeLimit(subject.time_limit_s, "--time-limit"))
        most = min(MAX_STATES, _MAX_RULES_READ // max(1, len(base.content.enabled_rules)))
        every = list(states_to_ask(base, subject.measured))
        for state in [KnowledgeState(), *spread(every, max(most, 1))]:
            pellet.analyze(state)
        yield from ignored_by_pellet(base)
    except InputError as error:
        found, left_out = Finding.of(error), "contradictions were not checked with Pellet"
        if found.rule in {one.rule for one in before if one.rule and one.level is Level.ERROR}:
            found = Finding(
                Level.NOTE, f"{left_out}: it does not use rule {found.rule} until it is corrected"
            )
        yield found


def ignored_by_pellet(base: Ontology) -> Iterator[Finding]:
    """Find the axioms that Pellet ignores; the same ontology is loaded once, then cached."""
    program = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
    kept = SharedEntries(private_cache("findings"), f"{base.content_hash[:32]}{program[:32]}")
    said = next((found for _, found in kept.read()), None)
    if said is None:
        said = ignored_axioms(base)
        kept.add("ignored", said)
    for axiom in said:
        file = ", ".join(map(relative_path, base.files))
        yield Finding(Level.WARN, f"Pellet ignores an axiom: {axiom}", file)


def states_to_ask(
    base: Ontology, measured: Collection[str] | None = None
) -> Iterator[KnowledgeState]:
    """States in which contradictions are looked for: all designs, reports, and ranges of measured
    values occur in one.

    Pellet's reasoning is monotonic, so a contradiction occurs in every state that contains it. Only
    attributes that have an effect and, if those are given, are measured count, and one component of
    those that are treated alike. With the rules of 2023, which contradict any other problem once a
    component recovered, that is in states of its own.
    """
    settings = ManagingSettings(
        measured=tuple(base.model.attributes if measured is None else measured)
    )
    space = PolicySpace.of(base, settings)
    apart = {RECOVERED} if rules_of_2023(base) else set()
    designs = {function: base.designs(function) for function in space.functions}
    for number in range(max(map(len, designs.values()), default=0)):
        groundings = {function: found[number % len(found)] for function, found in designs.items()}
        for status in space.statuses:
            for measurements in [{}] if status in apart else _measurements(space):
                yield KnowledgeState.of(
                    map(ObjectiveState, groundings),
                    groundings=groundings,
                    components={group[0]: status for group in space.alike},
                    measurements=measurements,
                )


def _measurements(space: PolicySpace) -> Iterator[dict[str, Decimal]]:
    """No measured values, and one value of all attributes for each place that it can have."""
    yield {}
    for place in range(1, len(space.scale)) if space.attributes else ():
        value = space.scale.value(place)
        if value is not None:
            yield dict.fromkeys(space.attributes, value)


def check_shapes(sources: Sequence[OntologyFile]) -> list[Finding]:
    """Check the model of ontologies against SHACL shapes; the same files are checked once, then
    cached.
    """
    shapes = (shipped_folder("ontology") / "tomasys-shapes.ttl").read_bytes()
    total = hashlib.sha256(
        f"{version('pyshacl')}{Path(__file__).read_bytes()!r}{shapes!r}".encode()
    )
    for source in sources:
        total.update(str(source.path).encode() + hashlib.sha256(source.content).digest())
    kept = SharedEntries(private_cache("findings"), total.hexdigest())
    for _, found in kept.read():
        return [Finding(**each | {"level": Level(each["level"])}) for each in found]
    findings = list(_validate(sources, Graph().parse(data=shapes, format="turtle")))
    kept.add("", [asdict(each) for each in findings])
    return findings


def _validate(sources: Sequence[OntologyFile], shapes: Graph) -> Iterator[Finding]:
    from pyshacl import validate

    data = Graph()
    for triple in chain.from_iterable(source.graph for source in sources):
        if str(triple[2]) != "NaN":  # which compares with nothing; another finding tells it
            data.add(triple)
    _, report, _ = validate(
        data, shacl_graph=shapes, do_owl_imports=False, meta_shacl=False, inplace=False
    )
    assert isinstance(report, Graph)
    for result in report.subjects(_SH.resultSeverity, None):
        # A query (SPARQL) is about the value that it gives, other constraints are about their
        # focus.
        is_query = (
            report.value(result, _SH.sourceConstraintComponent) == _SH.SPARQLConstraintComponent
        )
        thing = (report.value(result, _SH.value) if is_query else None) or report.value(
            result, _SH.focusNode
        )
        if is_query or not _is_placeholder(thing, data):
            yield _finding(report, result, thing, sources)


def _is_placeholder(node: Node | None, data: Graph) -> bool:
    """Whether an individual has nothing but a class, and nothing refers to it, so that it has no
    effect.
    """
    is_mentioned = any(predicate != RDF.type for predicate in data.predicates(node, None))
    return isinstance(node, URIRef) and not is_mentioned and (None, None, node) not in data


def _finding(
    report: Graph, result: Node, thing: Node | None, sources: Sequence[OntologyFile]
) -> Finding:
    # the names that rdflib gives are others each time
    name = "an individual without a name" if isinstance(thing, BNode) else local_name(str(thing))
    path = report.value(result, _SH.resultPath)
    level = _LEVELS.get(URIRef(str(report.value(result, _SH.resultSeverity))), Level.ERROR)
    words = (name, local_name(str(path or "")), str(report.value(result, _SH.resultMessage)))
    message = ": ".join(filter(None, words))
    is_value = path == URIRef(HAS_VALUE) and name.startswith(measurement_name(""))
    if is_value and not any((thing, path, None) in source.graph for source in sources):
        level = Level.NOTE
        message = f"{name} has no hasValue: missions give it the measured one"
    file, line = place_of(name, sources)
    if line is None:
        mentioning = (source for source in sources if thing in source.graph.all_nodes())
        file = next(mentioning, sources[0]).path
    return Finding(level, message, str(file), line)
