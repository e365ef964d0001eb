"""Derivations: how a fact follows, as a tree of rules with their bindings down to what is asserted.

Every step of a tree is made by Pellet: it is given the facts of one instantiated rule body, that rule and the schema,
and nothing else, and what it then adds is what the step concludes. Where a fact follows in several ways the first one
is told, by the rule's name and then by the bindings; Pellet's own choice (its tracing) is another one each time, and
is asked only where no rule and no single fact does it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

from suave_des.knowledge import jvm
from suave_des.knowledge.content import RULE_IRI, Content
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import InProcessPellet, load_n_triples, one_at_a_time
from suave_des.knowledge.rdf import Lit, Triple, facts_of, n_triple, value_of
from suave_des.knowledge.rules.syntax import Atom, Rule
from suave_des.knowledge.state import Fact, KnowledgeState, Value
from suave_des.knowledge.vocabulary import OWL, RDF_TYPE
from suave_des.workbench.derivation import Clash, Derivation
from suave_des.workbench.matching import Binding, canonical_triple, is_fact, matched, matches, values_of

_RULE: Final = re.compile(r"^rule\(" + re.escape(RULE_IRI) + r"(\d+)")
_FACT: Final = re.compile(r"^(prop|type)\(([^,()]+),([^,()]+)")
_IRI: Final = re.compile(r"[a-z]+:[^\s,()]+")
_FUNCTIONAL: Final = OWL + "FunctionalProperty"


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

    base: Ontology
    state: KnowledgeState
    _steps: dict[tuple[int, frozenset[Triple]], frozenset[Triple]] = field(default_factory=dict, repr=False)
    _found: dict[Triple, Derivation] = field(default_factory=dict, repr=False)

    @cached_property
    def situation(self) -> tuple[Triple, ...]:
        """What the state asserts."""
        return self.base.assertions(self.state)

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
        with one_at_a_time:
            found = self._derive(canonical_triple(triple), frozenset())
            return found if found is not None else self._by_tracing(triple)

    def _derive(self, triple: Triple, above: frozenset[Triple]) -> Derivation | None:
        """The first tree for a triple that does not rest on itself or on what is above it; None if there is none."""
        if triple in self._leaves:
            return self._leaf(self._leaves[triple])
        if triple not in self._found:
            inside = above | {triple}
            derivation = next(self._by_rules(triple, inside), None) or next(self._by_schema(triple, inside), None)
            if derivation is None:
                return None
            self._found[triple] = derivation
        return self._found[triple]

    def _by_rules(self, triple: Triple, above: frozenset[Triple]) -> Iterator[Derivation]:
        for rule in self.base.content.enabled_rules:
            for atom in rule.head:
                start = matched(atom, triple, {})
                if start is None:
                    continue
                for binding, body in sorted(matches(rule.body, start, (), self.known), key=str):
                    if above.isdisjoint(body) and triple in self._step(rule, frozenset(body)):
                        premises = [self._derive(each, above) for each in body]
                        if None not in premises:
                            yield self._by_rule(triple, rule, binding, [each for each in premises if each])

    def _by_rule(self, triple: Triple, rule: Rule, binding: Binding, premises: Sequence[Derivation]) -> Derivation:
        bound = tuple((name, value_of(binding[name], self.base.names)) for name in sorted(binding))
        return Derivation(self._fact(triple), "rule", rule.name, bound, tuple(premises))

    def _by_schema(self, triple: Triple, above: frozenset[Triple]) -> Iterator[Derivation]:
        """What follows from one other fact about the same thing: a class by a domain, an inverse, a sub-property."""
        for other in self.known:
            about = {triple[0], triple[2]} & {other[0], other[2]}
            if about and other not in above and triple in self._schema_adds(other, triple):
                premise = self._derive(other, above)
                if premise is not None:
                    axioms = self._traced(_denial(triple), (other,), ()).axioms
                    yield Derivation(self._fact(triple), "axioms", premises=(premise,), axioms=axioms)

    def _schema_adds(self, other: Triple, triple: Triple) -> frozenset[Triple]:
        key = -1, frozenset({other, triple})
        if key not in self._steps:
            content = replace(self._schema, triples=(*self._schema.triples, other))
            knowledge_base = load_n_triples(content.n_triples([]))
            kind = "class" if triple[1] == RDF_TYPE else "data" if isinstance(triple[2], Lit) else "object"
            predicate = str(triple[2]) if kind == "class" else triple[1]
            asked: Atom = Atom(kind, predicate, ())  # type: ignore[arg-type]
            is_possible = knowledge_base.isConsistent()
            self._steps[key] = frozenset(values_of(knowledge_base, [asked]) if is_possible else ())
        return self._steps[key]

    def _by_tracing(self, triple: Triple) -> Derivation:
        """What Pellet says that a triple rests on, without the steps between."""
        traced = self._traced(_denial(triple), self.asserted, self.base.content.enabled_rules)
        return Derivation(
            self._fact(triple), "axioms", premises=tuple(map(self._leaf, traced.triples)), axioms=traced.axioms
        )

    @cached_property
    def _leaves(self) -> dict[Triple, Triple]:
        """What is asserted, by its canonical form."""
        return {canonical_triple(triple): triple for triple in sorted(filter(is_fact, self.asserted), key=str)}

    @cached_property
    def known(self) -> tuple[Triple, ...]:
        """All that follows and that rules ask for, in canonical form and in a fixed order."""
        text = self.base.content.n_triples() + "".join(map(n_triple, self.situation))
        asked = [atom for rule in self.base.content.enabled_rules for atom in rule.atoms]
        entailed = self.entailed().union(values_of(load_n_triples(text), asked))
        jvm.take_warnings()
        return tuple(sorted({canonical_triple(triple) for triple in entailed if is_fact(triple)}, key=str))

    def firings(self, rule: Rule) -> Iterator[tuple[tuple[tuple[str, Value], ...], tuple[Fact, ...]]]:
        """Every way in which a rule fires: the bindings, and what it concludes."""
        with one_at_a_time:
            for binding, body in sorted(matches(rule.body, {}, (), self.known), key=str):
                concluded = self._step(rule, frozenset(body))
                if concluded:
                    bound = tuple((name, value_of(binding[name], self.base.names)) for name in sorted(binding))
                    yield bound, tuple(self._fact(triple) for triple in sorted(concluded, key=str))

    def clashes(self) -> tuple[str, tuple[Clash, ...], tuple[str, ...]]:
        """For a state that contradicts itself: what Pellet says, who clashes, and the names of the rules involved."""
        with one_at_a_time:
            known = self._chain()
        functional = {s for s, p, o in self.base.content.triples if p == RDF_TYPE and o == _FUNCTIONAL}
        values: dict[tuple[str, str], dict[str | Lit, Derivation]] = {}
        for (subject, predicate, value), derivation in known.items():
            if predicate in functional:
                values.setdefault((subject, predicate), {}).setdefault(value, derivation)
        short = self.base.names.short
        clashing = {
            (short(subject), short(predicate)) for (subject, predicate), sides in values.items() if len(sides) > 1
        }
        clashes = tuple(
            Clash(short(subject), short(predicate), tuple(sides[value] for value in sorted(sides, key=str)))
            for (subject, predicate), sides in sorted(values.items())
            # What follows from another clash is none of its own.
            if len(sides) > 1 and not any(clashing & side.grounds() for side in sides.values())
        )
        if clashes:
            rules = {name for clash in clashes for side in clash.sides for name in side.rules()}
            said = "; ".join(f"{each.subject} has two values of the functional {each.property}" for each in clashes)
            return said, clashes, tuple(sorted(rules))
        with one_at_a_time:
            traced = self._traced("", self.asserted, self.base.content.enabled_rules)
        said = _IRI.sub(lambda iri: short(iri.group()), traced.said).strip()
        return said, (), tuple(sorted(rule.name for rule in traced.rules))

    def _traced(self, denial: str, facts: Iterable[Triple], rules: Sequence[Rule]) -> _Traced:
        """What Pellet says is behind a contradiction: the state's own, or that of a fact with its denial."""
        options = jvm.java_class("org.mindswap.pellet.PelletOptions")
        options.USE_TRACING = True
        try:
            content = replace(self._schema, triples=(*self._schema.triples, *sorted(facts, key=str)))
            text = content.n_triples(rules) + denial
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

    def _chain(self) -> dict[Triple, Derivation]:
        """What all rules give from what is asserted, round by round; for a state in which Pellet tells nothing."""
        known = {triple: self._leaf(asserted) for triple, asserted in self._leaves.items()}
        while True:
            more = self._round(known) or self._schema_round(known)
            if not more:
                return known
            known |= more

    def _round(self, known: Mapping[Triple, Derivation]) -> dict[Triple, Derivation]:
        more: dict[Triple, Derivation] = {}
        for rule in self.base.content.enabled_rules:
            for binding, body in sorted(matches(rule.body, {}, (), known), key=str):
                for triple in sorted(self._step(rule, frozenset(body)) - known.keys(), key=str):
                    if triple not in more:
                        more[triple] = self._by_rule(triple, rule, binding, [known[each] for each in body])
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
                concluded = frozenset(map(canonical_triple, values_of(knowledge_base, rule.head))) - body
            jvm.take_warnings()
            self._steps[key] = concluded
        return self._steps[key]

    def _schema_round(self, known: Mapping[Triple, Derivation]) -> dict[Triple, Derivation]:
        """Classes and values that rules ask for and that the schema adds to what is asserted."""
        content = replace(self._schema, triples=(*self._schema.triples, *sorted(self.asserted, key=str)))
        knowledge_base = load_n_triples(content.n_triples([]))
        if not knowledge_base.isConsistent():
            return {}
        wanted = [atom for rule in self.base.content.enabled_rules for atom in rule.body]
        more = {}
        for triple in sorted(set(values_of(knowledge_base, wanted)) - known.keys(), key=str):
            fact = self._fact(triple)
            about = tuple(each for each in known.values() if not each.premises and each.fact.subject == fact.subject)
            more[triple] = Derivation(fact, "axioms", premises=about)
        return more

    @cached_property
    def _schema(self) -> Content:
        """The ontologies without facts of individuals; all rules keep their numbers."""
        content = self.base.content
        return replace(content, triples=tuple(each for each in content.triples if not is_fact(each)))

    def _leaf(self, triple: Triple) -> Derivation:
        return Derivation(self._fact(triple), "state" if triple in self.situation else "ontology")

    def _fact(self, triple: Triple) -> Fact:
        return next(facts_of([triple], self.base.names))


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
