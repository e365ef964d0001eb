"""Derivations: how a fact follows, as a tree of rules with their bindings down to what is asserted.

Pellet says what a fact rests on: with tracing on it names the rules and the asserted facts. The tree is put together
from those, and every step of it is made by Pellet again: it is given the facts of one instantiated rule body, that
rule and the schema, and nothing else, and what it then adds is what the step concludes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final

from suave_des.knowledge import jvm
from suave_des.knowledge.base import KnowledgeBase
from suave_des.knowledge.model import facts_of, value_of
from suave_des.knowledge.pellet import InProcessPellet, load_n_triples, one_at_a_time, read_term
from suave_des.knowledge.rule_syntax import Atom, Named, Term, Variable
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.situation import Lit, Triple
from suave_des.knowledge.state import Fact, KnowledgeState, Value
from suave_des.knowledge.triples import RULE_IRI, Content, canonical, n_triple
from suave_des.knowledge.vocabulary import LANGUAGE_NAMESPACES, OWL, RDF_TYPE

_RULE: Final = re.compile(r"^rule\(" + re.escape(RULE_IRI) + r"(\d+)")
_FACT: Final = re.compile(r"^(prop|type)\(([^,()]+),([^,()]+)")
_IRI: Final = re.compile(r"[a-z]+:[^\s,()]+")
_FUNCTIONAL: Final = OWL + "FunctionalProperty"
_Binding = Mapping[str, str | Lit]


@dataclass(frozen=True)
class Derivation:
    """How a fact follows.

    Attributes:
        fact: what follows.
        source: "state" or "ontology" where it is asserted, "rule", or "axioms" where it follows from the schema.
        rule: the rule's name.
        bindings: value of each of the rule's variables, by variable.
        premises: the facts of the rule's body, instantiated.
        axioms: what of the schema was used.
    """

    fact: Fact
    source: str
    rule: str | None = None
    bindings: tuple[tuple[str, Value], ...] = ()
    premises: tuple[Derivation, ...] = ()
    axioms: tuple[str, ...] = ()

    def leaves(self) -> Iterator[Derivation]:
        """The asserted facts that it rests on."""
        if not self.premises:
            yield self
        for premise in self.premises:
            yield from premise.leaves()

    def rules(self) -> frozenset[str]:
        """Names of all rules in it."""
        own = frozenset({self.rule} if self.rule is not None else ())
        return own.union(*(premise.rules() for premise in self.premises))


@dataclass(frozen=True)
class Clash:
    """A contradiction: one thing would have two values of a functional property.

    Attributes:
        subject, property: of what.
        sides: how each of the values follows.
    """

    subject: str
    property: str
    sides: tuple[Derivation, ...]


@dataclass(frozen=True)
class _Traced:
    """What Pellet says a contradiction rests on."""

    said: str
    rules: tuple[Rule, ...]
    triples: tuple[Triple, ...]
    axioms: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Tracer:
    """Derives facts of one state."""

    base: KnowledgeBase
    state: KnowledgeState
    _steps: dict[tuple[int, frozenset[Triple]], frozenset[Triple]] = field(default_factory=dict, repr=False)

    @cached_property
    def situation(self) -> tuple[Triple, ...]:
        """What the state asserts."""
        return self.base.situation(self.state)

    @cached_property
    def asserted(self) -> frozenset[Triple]:
        """What ontologies and state assert."""
        return frozenset((*self.base.content.triples, *self.situation))

    def entailed(self) -> frozenset[Triple]:
        """All that follows in the state.

        Raises:
            KnowledgeError: the state contradicts itself.
        """
        return InProcessPellet(self.base).infer(self.situation) | self.asserted

    def derive(self, triple: Triple) -> Derivation:
        """How a triple that is entailed follows."""
        if triple in self.asserted:
            return self._leaf(triple)
        with one_at_a_time:
            traced = self._traced(_denial(triple))
            known = self._chain(traced, triple)
        if triple in known:
            return known[triple]
        premises = tuple(known[each] for each in sorted(known, key=str))
        return Derivation(self._fact(triple), "axioms", premises=premises, axioms=traced.axioms)

    def firings(self, rule: Rule) -> Iterator[tuple[tuple[tuple[str, Value], ...], tuple[Fact, ...]]]:
        """Every way in which a rule fires: the bindings, and what it concludes."""
        known = dict.fromkeys(sorted(self.entailed(), key=str))
        with one_at_a_time:
            for binding, body in sorted(_matches(rule.body, {}, (), known), key=str):
                concluded = self._step(rule, frozenset(body))
                if concluded:
                    bound = tuple((name, value_of(binding[name], self.base.names)) for name in sorted(binding))
                    yield bound, tuple(self._fact(triple) for triple in sorted(concluded, key=str))

    def clashes(self) -> tuple[str, tuple[Clash, ...], tuple[str, ...]]:
        """For a state that contradicts itself: what Pellet says, who clashes, and the names of the rules involved."""
        with one_at_a_time:
            traced = self._traced("")
            known = self._chain(traced, None)
        functional = {s for s, p, o in self.base.content.triples if p == RDF_TYPE and o == _FUNCTIONAL}
        values: dict[tuple[str, str], dict[str | Lit, Derivation]] = {}
        for (subject, predicate, value), derivation in known.items():
            if predicate in functional:
                plain = canonical(value) if isinstance(value, Lit) else value
                values.setdefault((subject, predicate), {}).setdefault(plain, derivation)
        short = self.base.names.short
        clashes = tuple(
            Clash(short(subject), short(predicate), tuple(sides[value] for value in sorted(sides, key=str)))
            for (subject, predicate), sides in sorted(values.items())
            if len(sides) > 1
        )
        said = _IRI.sub(lambda iri: short(iri.group()), traced.said).strip()
        return said, clashes, tuple(sorted(rule.name for rule in traced.rules))

    def _traced(self, denial: str) -> _Traced:
        """Rules and facts behind a contradiction: the state's own, or that of a fact with its denial."""
        options = jvm.java_class("org.mindswap.pellet.PelletOptions")
        options.USE_TRACING = True
        try:
            text = self.base.content.n_triples() + "".join(map(n_triple, self.situation)) + denial
            knowledge_base = load_n_triples(text, explain=True)
            knowledge_base.isConsistent()
            said = str(knowledge_base.getExplanation())
            axioms = sorted(str(axiom.toString()) for axiom in knowledge_base.getExplanationSet())
        finally:
            options.USE_TRACING = False
            jvm.take_warnings()
        numbers = sorted(int(found.group(1)) for axiom in axioms if (found := _RULE.match(axiom)))
        named = {found.groups() for axiom in axioms if (found := _FACT.match(axiom))}
        used = [triple for triple in sorted(self.asserted, key=str) if _as_axiom(triple) in named]
        # Facts and the denial are no schema; what is left are domains, subclasses and the like.
        schema = [axiom for axiom in axioms if not axiom.startswith(("rule(", "prop(", "type("))]
        short = self.base.names.short
        return _Traced(
            said,
            tuple(self.base.content.rules[number] for number in numbers),
            tuple(used),
            tuple(_IRI.sub(lambda iri: short(iri.group()), axiom) for axiom in schema),
        )

    def _chain(self, traced: _Traced, target: Triple | None) -> dict[Triple, Derivation]:
        """What the traced rules give from the traced facts, round by round, until the target is there."""
        known = {triple: self._leaf(triple) for triple in traced.triples}
        while True:
            more = self._round(traced.rules, known)
            if not more:
                more = self._by_axioms(traced, known)
            if not more:
                return known
            known |= more
            if target is not None and target in known:
                return known

    def _round(self, rules: Sequence[Rule], known: Mapping[Triple, Derivation]) -> dict[Triple, Derivation]:
        more: dict[Triple, Derivation] = {}
        for rule in rules:
            for binding, body in sorted(_matches(rule.body, {}, (), known), key=str):
                for triple in sorted(self._step(rule, frozenset(body)) - known.keys(), key=str):
                    if triple not in more:
                        bindings = tuple(
                            (name, value_of(term, self.base.names)) for name, term in sorted(binding.items())
                        )
                        premises = tuple(known[each] for each in body)
                        more[triple] = Derivation(self._fact(triple), "rule", rule.name, bindings, premises)
        return more

    def _step(self, rule: Rule, body: frozenset[Triple]) -> frozenset[Triple]:
        """What Pellet concludes with one rule from the facts of one instantiated body, and the schema."""
        number = self.base.content.rules.index(rule)
        key = number, body
        if key not in self._steps:
            content = replace(self._schema, triples=(*self._schema.triples, *sorted(body, key=str)))
            knowledge_base = load_n_triples(content.n_triples([rule]))
            concluded: frozenset[Triple] = frozenset()
            if knowledge_base.isConsistent():
                concluded = frozenset(_values(knowledge_base, rule.head)) - body
            jvm.take_warnings()
            self._steps[key] = concluded
        return self._steps[key]

    def _by_axioms(self, traced: _Traced, known: Mapping[Triple, Derivation]) -> dict[Triple, Derivation]:
        """What the schema alone adds to what is known: classes by domains, inverses and the like."""
        content = replace(self._schema, triples=(*self._schema.triples, *sorted(known, key=str)))
        knowledge_base = load_n_triples(content.n_triples([]))
        if not knowledge_base.isConsistent():
            return {}
        wanted = [atom for rule in traced.rules for atom in rule.body]
        premises = tuple(known[each] for each in sorted(known, key=str))
        more: dict[Triple, Derivation] = {}
        for triple in sorted(set(_values(knowledge_base, wanted)) - known.keys(), key=str):
            fact = self._fact(triple)
            about = tuple(each for each in premises if fact.subject in (each.fact.subject, each.fact.value))
            more[triple] = Derivation(fact, "axioms", premises=about, axioms=traced.axioms)
        return more

    @cached_property
    def _schema(self) -> Content:
        """The ontologies without facts of individuals; all rules keep their numbers."""
        content = self.base.content
        return replace(content, triples=tuple(each for each in content.triples if not _is_fact(each)))

    def _leaf(self, triple: Triple) -> Derivation:
        return Derivation(self._fact(triple), "state" if triple in self.situation else "ontology")

    def _fact(self, triple: Triple) -> Fact:
        return next(facts_of([triple], self.base.names))


def _is_fact(triple: Triple) -> bool:
    term = triple[2] if triple[1] == RDF_TYPE else triple[1]
    return isinstance(term, str) and not term.startswith(LANGUAGE_NAMESPACES)


def _as_axiom(triple: Triple) -> tuple[str, str, str]:
    """The beginning of a fact as Pellet writes it: enough to tell which one it is among those asserted."""
    subject, predicate, value = triple
    return ("type", subject, str(value)) if predicate == RDF_TYPE else ("prop", predicate, subject)


def _denial(triple: Triple) -> str:
    """Says in OWL that a triple does not hold."""
    subject, predicate, value = triple
    node = "_:denied"
    lines: list[str] = []

    def add(of: str, term: str, what: str | Lit) -> None:
        line = n_triple(("urn:x", term, what))
        lines.append(line.replace("<urn:x>", of, 1))

    if predicate == RDF_TYPE:
        add(node, OWL + "complementOf", value)
    else:
        lines.append(f"{node} <{OWL}complementOf> {node}value .\n")
        add(f"{node}value", RDF_TYPE, OWL + "Restriction")
        add(f"{node}value", OWL + "onProperty", predicate)
        add(f"{node}value", OWL + "hasValue", value)
    add(node, RDF_TYPE, OWL + "Class")
    lines.append(f"<{subject}> <{RDF_TYPE}> {node} .\n")
    return "".join(lines)


def _matches(
    atoms: Sequence[Atom], binding: _Binding, body: tuple[Triple, ...], known: Iterable[Triple]
) -> Iterator[tuple[_Binding, tuple[Triple, ...]]]:
    """Ways to match the atoms that ask for facts; comparisons and the like are left to Pellet."""
    if not atoms:
        yield binding, body
        return
    atom, rest = atoms[0], atoms[1:]
    if atom.kind not in ("class", "object", "data"):
        yield from _matches(rest, binding, body, known)
        return
    for triple in known:
        subject, predicate, value = triple
        asked: list[tuple[Term, str | Lit]]
        if atom.kind == "class":
            asked, given = [(atom.arguments[0], subject)], predicate == RDF_TYPE and value == atom.predicate
        else:
            asked = [(atom.arguments[0], subject), (atom.arguments[-1], value)]
            given = predicate == atom.predicate
        if given and (bound := _bound(asked, binding)) is not None:
            yield from _matches(rest, bound, body if triple in body else (*body, triple), known)


def _bound(pairs: Iterable[tuple[Term, str | Lit]], binding: _Binding) -> _Binding | None:
    found = dict(binding)
    for term, value in pairs:
        plain = canonical(value) if isinstance(value, Lit) else value
        if isinstance(term, Variable):
            if found.setdefault(term.name, plain) != plain:
                return None
        elif (term.iri if isinstance(term, Named) else canonical(term)) != plain:
            return None
    return found


def _values(knowledge_base: Any, atoms: Iterable[Atom]) -> Iterator[Triple]:
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
