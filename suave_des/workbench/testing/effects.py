"""What a mutant can change: where it can infer something else, and whether what it leaves out follows anyway."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import Lit, Triple
from suave_des.knowledge.rules.syntax import Named, Variable
from suave_des.knowledge.state import KnowledgeState
from suave_des.knowledge.vocabulary import HAS_VALUE, OWL, RDF_TYPE, RDFS, XSD
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.matching import FACT_KINDS, instance, matched
from suave_des.workbench.prover import Body, Prover, Situation
from suave_des.workbench.testing.mutants import Mutant

_NOT_HORN: Final = (
    *("unionOf", "complementOf", "oneOf", "disjointUnionOf", "maxCardinality", "maxQualifiedCardinality"),
    *("cardinality", "qualifiedCardinality", "minQualifiedCardinality", "minCardinality", "allValuesFrom"),
)
_FROZEN: Final = "urn:suave-des:any#"


def touching(base: Ontology, mutant: Mutant) -> Iterator[Body]:
    """Conjunctions of which one holds wherever a mutant can infer something else."""
    if mutant.old is not None:
        yield _plain(mutant.old.body)
        if mutant.new is not None:
            yield _plain(mutant.new.body)
        return
    for triple in (mutant.removed, mutant.added):
        assert triple is not None
        for rule in base.content.enabled_rules:
            for number, atom in enumerate(rule.body):
                binding = matched(atom, triple, {}) if atom.kind in FACT_KINDS else None
                if binding is not None:
                    rest = (*rule.body[:number], *rule.body[number + 1 :])
                    yield tuple(instance(each, binding) for each in rest)


def _plain(body: Body) -> Body:
    return tuple(replace(atom, places=()) for atom in body)


def follows_anyway(bench: KnowledgeBase, mutant: Mutant) -> bool:
    """Whether an atom that a mutant leaves out follows from the others, whatever the state.

    The other atoms are asserted of individuals of which nothing else is known; what follows then, follows of all.
    """
    if mutant.old is None or mutant.new is None or not mutant.generalises:
        return False
    dropped = next((atom for atom in mutant.old.body if atom not in mutant.new.body), None)
    if dropped is None or dropped.kind not in FACT_KINDS:
        return False
    free = {name: f"{_FROZEN}{name}" for name in dropped.variables()}
    facts: list[Triple] = []
    for atom in mutant.new.body:
        if atom.kind in ("class", "object"):
            terms = [
                term.iri if isinstance(term, Named) else f"{_FROZEN}{term.name}"
                for term in atom.arguments
                if isinstance(term, Named | Variable)
            ]
            is_class = atom.kind == "class"
            facts.append((terms[0], RDF_TYPE if is_class else atom.predicate, atom.predicate if is_class else terms[1]))
        elif atom.kind == "data" and isinstance(atom.arguments[0], Variable) and isinstance(atom.arguments[1], Lit):
            facts.append((f"{_FROZEN}{atom.arguments[0].name}", atom.predicate, atom.arguments[1]))
        elif atom.kind == "data" and isinstance(atom.arguments[0], Variable) and atom.predicate == HAS_VALUE:
            facts.append((f"{_FROZEN}{atom.arguments[0].name}", atom.predicate, Lit("123.456", XSD + "decimal")))
    asked = instance(dropped, free)
    prover = Prover.of(bench, bodies=[(asked,)])
    return prover.holding(Situation(KnowledgeState(), tuple(facts))) == {0}


def is_horn(base: Ontology) -> bool:
    """Whether no axiom leaves a choice, so that what follows is what the rules and axioms build up step by step."""
    datatypes = {line.split(" ", 1)[0] for line in base.content.structure if f"<{RDF_TYPE}> <{RDFS}Datatype>" in line}
    return not any(
        f"<{OWL}{name}>" in line and line.split(" ", 1)[0] not in datatypes
        for line in base.content.structure
        for name in _NOT_HORN
    )
