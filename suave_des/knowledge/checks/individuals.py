"""Check the individuals and classes of ontologies for edits that mean something else than was wanted."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import chain
from typing import Final

from suave_des.knowledge.checks.findings import Finding, Level, finding_about
from suave_des.knowledge.checks.kinds import with_article
from suave_des.knowledge.content import Content
from suave_des.knowledge.model import Model, estimations
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rdf import (
    C_STATUS,
    HAS_VALUE,
    LANGUAGE_NAMESPACES,
    MROS,
    OWL,
    RDF_TYPE,
    RDFS,
    TOMASYS,
    XSD,
    Lit,
    local_name,
    memberships,
    reached,
)
from suave_des.knowledge.rules.syntax import SAME, Named
from suave_des.knowledge.rules.writer import literal_text

#: Triples that declare an individual, and say nothing of it.
_BARE: Final = {(RDF_TYPE, OWL + "NamedIndividual"), (RDF_TYPE, OWL + "Thing")}
_BINDING_COMPONENT: Final = "binding_component"
#: Classes whose members have names with a prefix.
_PREFIXES: Final = {"FunctionDesign": "fd_", "Function": "f_", "Component": "c_", "QAvalue": "qa_"}


def confused_individuals(
    content: Content, model: Model, sources: Sequence[OntologyFile], measured: Collection[str] | None
) -> Iterator[Finding]:
    """Find individuals that are made the same, have no class, or have values that do not count.

    Args:
        content: the ontologies and rules.
        model: what is in them.
        sources: the files that they come from.
        measured: quality attributes that missions measure; None: any.
    """
    for group, what in ((model.designs, "function designs"), (model.functions, "functions")):
        names = {iri: name for name, iri in group.items()}
        for subject, predicate, value in content.triples:
            if predicate == SAME and subject in names and value in names and subject != value:
                other = names[str(value)]
                message = f"{names[subject]} is the same as {other} (sameAs), so what holds of one holds of both"
                yield finding_about(names[subject], sources, Level.WARN, message, f"remove it, or use two {what}")
    yield from _two_estimates(content, model, sources)
    for name in sorted(map(local_name, _meaningless(content, model))):
        remedy = "add a type, such as FunctionDesign"
        yield finding_about(name, sources, Level.WARN, f"{name} has no class, so it means nothing", remedy)
    values = {each.iri: name for name, each in model.measurements.items()}
    for subject, predicate, _ in content.triples:
        if predicate == HAS_VALUE and subject in values:
            name = values[subject]
            message = f"hasValue of {local_name(subject)} is not used: {name} has the value that missions measure"
            is_lost = measured is not None and name not in measured
            level, use = (Level.WARN, "measure it in the scenario") if is_lost else (Level.INFO, None)
            yield finding_about(local_name(subject), sources, level, message, use)


def _meaningless(content: Content, model: Model) -> set[str]:
    """Individuals that are declared and have neither class nor facts, and that nothing mentions."""
    found = {subject for subject, predicate, value in content.triples if (predicate, value) in _BARE}
    found -= {individual for individual, _ in memberships(content.triples)}
    found -= {each.iri for each in model.individuals()}
    for subject, predicate, value in content.triples:
        if predicate == SAME or not predicate.startswith(LANGUAGE_NAMESPACES):
            found -= {subject, str(value)}
    terms = chain.from_iterable(atom.arguments for rule in content.rules for atom in rule.atoms)
    found -= {term.iri for term in terms if isinstance(term, Named)}
    return {iri for iri in found if not any(f"<{iri}>" in axiom for axiom in content.structure)}


def _two_estimates(content: Content, model: Model, sources: Sequence[OntologyFile]) -> Iterator[Finding]:
    """Find designs that expect several values of one quality attribute."""
    numbers = {each: value for each, name, value in content.triples if name == HAS_VALUE and isinstance(value, Lit)}
    expected: dict[tuple[str, str], dict[str, str]] = defaultdict(dict)
    for design, attribute, individual in estimations(content.triples, model.designs, model.attributes):
        if individual in numbers:
            expected[design, attribute][local_name(individual)] = numbers[individual].text
    for (design, attribute), values in sorted(expected.items()):
        if len(set(values.values())) > 1:
            listing = " and ".join(f"{name} ({value})" for name, value in sorted(values.items()))
            message = f"{design} expects several values of {attribute}: {listing}; the planner uses the least"
            yield finding_about(design, sources, Level.WARN, message, "keep one hasQAestimation")


def classes_instead_of_individuals(
    content: Content, model: Model, sources: Sequence[OntologyFile], modes: Collection[str]
) -> Iterator[Finding]:
    """Find classes that share their name with an individual, or that probably should be individuals.

    Args:
        content: the ontologies and rules.
        model: what is in them.
        sources: the files that they come from.
        modes: names of modes, which are those of function designs.
    """
    kinds = {(RDF_TYPE, OWL + "Class"), (RDF_TYPE, RDFS + "Class")}
    classes = {subject for subject, predicate, value in content.triples if (predicate, value) in kinds}
    members = list(memberships(content.triples))
    groups: tuple[Mapping[str, str], ...] = (model.functions, model.designs, model.components, model.attributes)
    things = {local_name(individual) for individual, _ in members}.union(*groups)
    above = [(one, str(other)) for one, name, other in content.triples if name == RDFS + "subClassOf"]
    used = {name for _, name in members} | {other for _, other in above} | content.head_classes()
    for iri in sorted(classes):
        name = local_name(iri)
        if name in things:
            message = f"{name} is the name of a class and of an individual"
            yield finding_about(name, sources, Level.WARN, message, "rename one, or remove the one that is not meant")
            continue
        if iri in used or iri.startswith((TOMASYS, MROS)):
            continue
        for kind in sorted(map(local_name, reached({iri}, above) - {iri})):
            if kind in _PREFIXES and (name.startswith(_PREFIXES[kind]) or (kind == "FunctionDesign" and name in modes)):
                message = f"{name} is a class without members; {with_article(kind)} is an individual"
                yield finding_about(name, sources, Level.WARN, message, f"make it an individual of {kind} instead")


def misspelt_facts(
    content: Content, model: Model, sources: Sequence[OntologyFile], reported: Collection[str]
) -> Iterator[Finding]:
    """Find the asserted statuses of components that look like one that is reported, and are another value."""
    if any(local_name(predicate) == _BINDING_COMPONENT for _, predicate, _ in content.triples):
        return  # a model in which statuses are true or false
    names = {iri: name for name, iri in model.components.items()}
    for subject, predicate, value in content.triples:
        if predicate == C_STATUS and isinstance(value, Lit) and subject in names:
            is_right = value.datatype == XSD + "string" and value.text in reported
            if not is_right and value.text.upper() in reported:
                shown = literal_text(value)
                message = f'c_status of {names[subject]} is {shown}, but missions and rules have "{value.text.upper()}"'
                yield finding_about(names[subject], sources, Level.WARN, message, f'write "{value.text.upper()}"')
