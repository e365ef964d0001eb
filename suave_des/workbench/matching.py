"""Which facts a rule's atoms can be about: proposals, which Pellet then confirms or not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from suave_des.knowledge import jvm
from suave_des.knowledge.pellet import read_term
from suave_des.knowledge.rdf import Lit, Triple, canonical
from suave_des.knowledge.rules.syntax import Atom, Named, Term, Variable
from suave_des.knowledge.vocabulary import LANGUAGE_NAMESPACES, RDF_TYPE

#: What the variables of a rule stand for: IRIs and literals by name.
Binding = Mapping[str, str | Lit]


def is_fact(triple: Triple) -> bool:
    """Whether a triple says something of an individual, and not in the terms of the languages themselves."""
    term = triple[2] if triple[1] == RDF_TYPE else triple[1]
    return isinstance(term, str) and not term.startswith(LANGUAGE_NAMESPACES)


def matches(
    atoms: Sequence[Atom], binding: Binding, body: tuple[Triple, ...], known: Iterable[Triple]
) -> Iterator[tuple[Binding, tuple[Triple, ...]]]:
    """Ways to match the atoms that ask for facts; comparisons and the like are left to Pellet."""
    if not atoms:
        yield binding, body
        return
    atom, rest = atoms[0], atoms[1:]
    if atom.kind not in ("class", "object", "data"):
        yield from matches(rest, binding, body, known)
        return
    for triple in known:
        bound = matched(atom, triple, binding)
        if bound is not None:
            yield from matches(rest, bound, body if triple in body else (*body, triple), known)


def matched(atom: Atom, triple: Triple, binding: Binding) -> Binding | None:
    """The binding with what an atom's variables must be for it to say this triple; None if it cannot."""
    subject, predicate, value = triple
    if atom.kind == "class":
        given = predicate == RDF_TYPE and value == atom.predicate
        return _bound([(atom.arguments[0], subject)], binding) if given else None
    if atom.kind not in ("object", "data") or predicate != atom.predicate:
        return None
    return _bound([(atom.arguments[0], subject), (atom.arguments[-1], value)], binding)


def canonical_triple(triple: Triple) -> Triple:
    """A triple with a number in its one shortest form."""
    subject, predicate, value = triple
    return subject, predicate, canonical(value) if isinstance(value, Lit) else value


def _bound(pairs: Iterable[tuple[Term, str | Lit]], binding: Binding) -> Binding | None:
    found = dict(binding)
    for term, value in pairs:
        plain = canonical(value) if isinstance(value, Lit) else value
        if isinstance(term, Variable):
            if found.setdefault(term.name, plain) != plain:
                return None
        elif (term.iri if isinstance(term, Named) else canonical(term)) != plain:
            return None
    return found


def values_of(knowledge_base: Any, atoms: Iterable[Atom]) -> Iterator[Triple]:
    """Values of the properties and members of the classes that atoms name."""
    make = jvm.java_class("org.mindswap.pellet.utils.ATermUtils").makeTermAppl
    for kind, name in sorted({(atom.kind, atom.predicate) for atom in atoms}):
        if kind in ("object", "data"):
            for entry in knowledge_base.getPropertyValues(make(name)).entrySet():
                for value in entry.getValue():
                    yield str(entry.getKey().toString()), name, read_term(str(value.toString()))
        elif kind == "class":
            for member in knowledge_base.getInstances(make(name)):
                yield str(member.toString()), RDF_TYPE, name
