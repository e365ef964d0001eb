"""Explain why a fact follows, why a rule does not fire, and why a function design is chosen or not.

All facts in a derivation are Pellet's, and so is what its built-ins say of their values. Where a
fact follows in several ways, the shortest one is shown, and of those the first by the rule's name
and then by the bindings.
Pellet's own tracing picks another one each time, and is asked only where neither a rule nor a
single fact suffices.

Of a rule that does not fire, what makes it useless in every state comes first: it is switched off,
or is dropped by Pellet. Else the answer is the first atom that fails, for the binding that comes
nearest, with the value found and the value needed.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import filterfalse, islice
from operator import attrgetter
from types import MappingProxyType
from typing import NamedTuple

from suave_des.errors import InputError, KnowledgeError, shown, unknown
from suave_des.kb.matching import (
    Binding,
    Bound,
    Facts,
    bound,
    concluding,
    matches,
    nearest_match,
    shown_bindings,
    stated,
    told_of,
    tracing_pellet,
    unified,
    with_bindings,
)
from suave_des.kb.states import FactReader
from suave_des.knowledge.ontology import Content, Ontology
from suave_des.knowledge.pellet.in_process import (
    InProcessPellet,
    dropped_rules,
    entailed,
    one_at_a_time,
    trace_contradiction,
)
from suave_des.knowledge.rdf import (
    C_STATUS,
    HAS_QA_VALUE,
    NUMERIC,
    OWL,
    RDF_TYPE,
    TOMASYS,
    Lit,
    Triple,
    canonical,
    fact_of,
    facts_of,
    is_fact,
    is_node,
    local_name,
    n_triple,
    terms,
    value_of,
)
from suave_des.knowledge.reasoner import performance
from suave_des.knowledge.rules import (
    COMPARISONS,
    FACT_KINDS,
    IDENTITIES,
    Atom,
    AtomKind,
    Rule,
    Variable,
    write_atom,
    write_term,
)
from suave_des.knowledge.rules.files import fatal_problems, rule_problems
from suave_des.knowledge.state import (
    ContradictionError,
    Decision,
    Fact,
    KnowledgeState,
    Reasoning,
    value_text,
)

_IRI = re.compile(r"[a-z]+:[^\s,()]+")


@dataclass(frozen=True)
class Derivation:
    """How a fact follows.

    Attributes:
        source: "state" or "ontology" where it is asserted, "rule", or "axioms" where it follows
            from the schema.
        bindings: value of each of the rule's variables, by variable.
        axioms: the axioms of the schema that were used.
        premises: the facts of the rule's body, instantiated.
    """

    fact: Fact
    source: str
    rule: str | None = None
    bindings: Bound = ()
    axioms: tuple[str, ...] = ()
    premises: tuple[Derivation, ...] = ()

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def lines(self, indent: str = "", told: set[Fact] | None = None) -> Iterator[str]:
        """The fact and how it follows, and below it, indented, the facts that it follows from;
        what was told above is not told again.
        """
        told = set() if told is None else told
        how = {
            "rule": f"by rule {self.rule}{with_bindings(self.bindings)}",
            "axioms": f"by the schema: {'; '.join(self.axioms)}"
            if self.axioms
            else "by the schema",
            "state": "given in the state",
            "ontology": "asserted in the ontology",
        }[self.source]
        is_told = bool(self.premises) and self.fact in told
        told.add(self.fact)
        yield f"{indent}{self.fact}  [{how}{'; see above' if is_told else ''}]"
        for premise in () if is_told else self.premises:
            yield from premise.lines(indent + "  ", told)

    def rules(self) -> frozenset[str]:
        """Names of all rules in it."""
        waiting, seen = [self], {id(self): self}
        for each in waiting:  # grows meanwhile, by premises that several may share
            new = {id(one): one for one in each.premises if id(one) not in seen}
            seen |= new
            waiting += new.values()
        return frozenset(each.rule for each in waiting if each.rule is not None)


@dataclass(frozen=True, eq=False)
class Tracer:
    """Derives the facts of one state.

    Attributes:
        pellet: tracing_pellet of the ontologies.
    """

    base: Ontology
    state: KnowledgeState
    pellet: InProcessPellet
    _found: dict[Triple, Derivation] = field(default_factory=dict)
    _ways: dict[Triple, list[_Way]] = field(default_factory=dict)
    _asked: set[Triple] = field(default_factory=set)

    @cached_property
    def asserted(self) -> frozenset[Triple]:
        """What ontologies and state assert."""
        return frozenset((*self._given, *self.base.content.triples))

    @cached_property
    def _given(self) -> tuple[Triple, ...]:
        """What the state asserts."""
        return self.base.assertions(self.state)

    @cached_property
    def entailed(self) -> frozenset[Triple]:
        """All that follows in the state.

        Raises:
            KnowledgeError: the state contradicts itself.
        """
        asks = any(rule.speaks_of_identity for rule in self.base.content.enabled_rules)
        same = self.pellet.identities(self._given) if asks else ()
        return self._told[0].union(self.asserted, same)

    @cached_property
    def holding(self) -> frozenset[int]:
        """The numbers of the bodies that hold, of those that Pellet was asked for."""
        return self._told[1]

    @cached_property
    def _told(self) -> tuple[frozenset[Triple], frozenset[int]]:
        return told_of(self.base, self.pellet.infer(self._given))

    @cached_property
    def known(self) -> tuple[Triple, ...]:
        """All that follows and that rules mention, in canonical form and in a fixed order."""
        told = set(map(canonical_triple, filter(_is_told, self.entailed)))
        return tuple(sorted(told, key=str))

    @cached_property
    def _facts(self) -> Facts:
        return Facts(self.known)

    @cached_property
    def _leaves(self) -> dict[Triple, Triple]:
        """What is asserted, by its canonical form."""
        told = sorted(filter(_is_told, self.asserted), key=str)
        return {canonical_triple(each): triple for triple in told for each in _both_ways(triple)}

    @cached_property
    def _schema(self) -> Content:
        """The ontologies without facts about individuals; all rules keep their numbers."""
        content = self.base.content
        return replace(content, triples=tuple(filterfalse(is_fact, content.triples)))

    def derive(self, triple: Triple) -> Derivation:
        """Derive a triple that is entailed."""
        with one_at_a_time:
            wanted = canonical_triple(triple)
            self._collect(wanted)
            while wanted not in self._found:
                if not (self._step() or self._ask_schema() or self._ask_axioms()):
                    return self._by_all(triple)
            return self._found[wanted]

    def firings(self, rule: Rule) -> Iterator[tuple[Bound, tuple[Fact, ...]]]:
        """Find every way in which a rule fires: the bindings, and the facts that it concludes."""
        with one_at_a_time:
            for binding in matches(rule, self._facts):
                concluded = _all_stated(rule.head, binding)
                # What is the same, Pellet knows.
                if all(canonical_triple(triple) in self._facts for triple in concluded):
                    facts = tuple(map(self._fact, sorted(concluded, key=str)))
                    yield shown_bindings(binding, self.base.names), facts

    def _collect(self, wanted: Triple) -> None:
        """Find all ways in which rules conclude a fact, and what they conclude it from, and so
        on.
        """
        waiting = [wanted]
        while waiting:
            triple = waiting.pop()
            if triple in self._found or triple in self._ways:
                continue
            if triple in self._leaves:
                leaf = self._leaves[triple]
                source = "state" if leaf in self._given else "ontology"
                self._found[triple] = Derivation(self._fact(leaf), source)
            elif _is_expression(triple):
                self._found[triple] = Derivation(self._fact(triple), "axioms")
            else:
                self._ways[triple] = list(self._ways_of(triple))
                waiting += (each for way in self._ways[triple] for each in way.body)

    def _ways_of(self, triple: Triple) -> Iterator[_Way]:
        for rule in self.base.content.enabled_rules:
            for start in concluding(rule, _both_ways(triple)):
                for binding in matches(rule, self._facts, start):
                    body = dict.fromkeys(map(canonical_triple, _all_stated(rule.body, binding)))
                    bindings = shown_bindings(binding, self.base.names)
                    yield _Way(tuple(body), rule.name, bindings)

    def _step(self) -> bool:
        """Derive all facts that follow from those derived so far; each depends on no later one.

        Returns:
            whether there was any.
        """
        new = {}
        for triple in self._open:
            ready = (way for way in self._ways[triple] if self._found.keys() >= {*way.body})
            for way in islice(ready, 1):
                new[triple] = way
        for triple, (body, rule, bindings) in new.items():
            axioms = self._axioms(triple, body) if rule is None else ()
            source = "axioms" if rule is None else "rule"
            premises = tuple(self._found[each] for each in body)
            fact = self._fact(triple)
            self._found[triple] = Derivation(fact, source, rule, bindings, axioms, premises)
        return bool(new)

    @property
    def _open(self) -> list[Triple]:
        """What is wanted and has not been derived yet."""
        return sorted((each for each in self._ways if each not in self._found), key=str)

    def _ask_schema(self) -> bool:
        """Find of what is still open what follows from one other fact about the same thing: a class
        by a domain, an inverse, a sub-property.

        Returns:
            whether there is a new way.
        """
        is_new = False
        for triple in self._open:
            if triple in self._asked:
                continue
            self._asked.add(triple)
            if triple[1] in IDENTITIES:  # they follow from all that is asserted
                self._found[triple] = self._by_all(triple)
                return True
            asked = _asked_of(triple)
            for other in self.known:
                about_same = {triple[0], triple[2]} & {other[0], other[2]}
                if not about_same or other == triple or _is_expression(other):
                    continue
                if triple in self._concluded(other, asked):
                    self._ways[triple].append(_Way((other,)))
                    self._collect(other)
                    is_new = True
        return is_new

    def _ask_axioms(self) -> bool:
        """Derive what of the rest follows by axioms from several facts: of a transitive property.

        Returns:
            whether there was any.
        """
        told = [each for each in (*self._leaves.values(), *self._found) if not _is_expression(each)]
        rest = self._open
        follows = entailed(self._text(told, ()), list(map(_asked_of, rest)))
        for triple in set(rest).intersection(map(canonical_triple, follows)):
            axioms = self._axioms(triple, told)
            self._found[triple] = Derivation(self._fact(triple), "axioms", axioms=axioms)
        return len(self._open) < len(rest)

    def _by_all(self, triple: Triple) -> Derivation:
        """The axioms that Pellet says that a triple follows from, without the steps between."""
        axioms = self._axioms(triple, self.asserted, self.base.content.enabled_rules)
        return Derivation(self._fact(triple), "axioms", axioms=axioms)

    @cached_property
    def _concluded(self) -> Callable[[Triple, Atom], set[Triple]]:
        """What Pellet says of the property or class of an atom, from a fact and the schema
        alone.
        """

        @cache
        def concluded(fact: Triple, asked: Atom) -> set[Triple]:
            return set(map(canonical_triple, entailed(self._text([fact], ()), [asked])))

        return concluded

    def _text(self, facts: Iterable[Triple], rules: Sequence[Rule]) -> str:
        content = replace(self._schema, triples=(*self._schema.triples, *sorted(facts, key=str)))
        return content.n_triples(rules)

    def _axioms(
        self, triple: Triple, facts: Iterable[Triple], rules: Sequence[Rule] = ()
    ) -> tuple[str, ...]:
        """The axioms of the schema by which a triple follows from facts: domains, subclasses and
        the like.
        """
        _, used = trace_contradiction(self._text(facts, rules) + _denial(triple))
        denied = f"({triple[0]},{triple[2]})"  # what is the same or different, by _denial
        return tuple(
            _IRI.sub(lambda iri: self.base.names.short(iri.group()), each)
            for each in used
            if not each.startswith(("rule(", "prop(", "type(")) and denied not in each
        )

    def _fact(self, triple: Triple) -> Fact:
        return fact_of(triple, self.base.names)


class _Way(NamedTuple):
    """A way in which a fact follows from others: by a rule, or by axioms."""

    body: tuple[Triple, ...]
    rule: str | None = None
    bindings: Bound = ()


def _all_stated(atoms: Iterable[Atom], binding: Binding) -> list[Triple]:
    """The triples that atoms say."""
    return [said for atom in atoms if (said := stated(atom, binding)) is not None]


def _is_expression(triple: Triple) -> bool:
    """Whether a triple says that something is a member of a class expression."""
    return triple[1] == RDF_TYPE and is_node(triple[2])


def _asked_of(triple: Triple) -> Atom:
    """An atom that asks for the class or property of a triple."""
    kind: AtomKind = "data" if isinstance(triple[2], Lit) else "object"
    if triple[1] == RDF_TYPE:
        return Atom("class", str(triple[2]), ())
    return Atom(kind, triple[1], ())


def _is_told(triple: Triple) -> bool:
    """Whether derivations tell a triple: a fact, or what is the same or different."""
    return is_fact(triple) or triple[1] in IDENTITIES


def _both_ways(triple: Triple) -> tuple[Triple, ...]:
    """A triple and, where it says what is the same or different, the same from the other side."""
    subject, name, value = triple
    return (triple, (str(value), name, subject)) if name in IDENTITIES else (triple,)


def canonical_triple(triple: Triple) -> Triple:
    """The triple that stands for all that say the same with another form of its value."""
    return (*triple[:2], canonical(triple[2]))


def _denial(triple: Triple) -> str:
    """Say in OWL that a triple does not hold, as N-Triples."""
    subject, predicate, value = triple
    if predicate in IDENTITIES:
        return n_triple((subject, next(each for each in IDENTITIES if each != predicate), value))
    denied, restriction = "urn:denied", "urn:restriction"
    triples: list[Triple] = [
        (denied, OWL + "complementOf", value if predicate == RDF_TYPE else restriction),
        (denied, RDF_TYPE, OWL + "Class"),
        (subject, RDF_TYPE, denied),
    ]
    if predicate != RDF_TYPE:
        triples += [
            (restriction, RDF_TYPE, OWL + "Restriction"),
            (restriction, OWL + "onProperty", predicate),
            (restriction, OWL + "hasValue", value),
        ]
    return re.sub("<urn:(denied|restriction)>", r"_:\1", "".join(map(n_triple, triples)))


_WORDS = {
    "<": "less than",
    "<=": "at most",
    ">": "greater than",
    ">=": "at least",
    "=": "equal to",
    "!=": "different from",
}
_OF_GROUNDINGS = sorted(terms(TOMASYS, "FunctionGrounding typeFD solvesO"))
#: What a state asserts, and how to give it where it is missing.
_GIVEN_BY_STATES = {
    **dict.fromkeys(_OF_GROUNDINGS, "; ground a function: --at FUNCTION=DESIGN"),
    C_STATUS: "; report a component: --at COMPONENT=FALSE",
    HAS_QA_VALUE: "; measure what the grounded design expects: --at ATTRIBUTE=NUMBER",
    TOMASYS + "Objective": "; ask for a function: --at FUNCTION",
}
#: All that states assert.
_IN_STATES = terms(TOMASYS, "QAvalue hasValue isQAtype typeF o_status o_always_improve").union(
    _GIVEN_BY_STATES
)


class WhyNot(NamedTuple):
    """Why a rule does not fire, or that it does.

    Attributes:
        answer: in one line, without the rule's name.
        fires: whether its whole body holds.
        failing: number of the atoms that do not hold there; 0 where the answer is not about atoms.
    """

    rule: str
    answer: str
    fires: bool = False
    failing: int = 0

    def __str__(self) -> str:
        return f"{self.rule}: {self.answer}"


@dataclass(frozen=True)
class RuleQuestions:
    """Answers for the rules of one knowledge base.

    Example:
        >>> questions = RuleQuestions(knowledge.base)
        >>> print(questions.why_not("compError", knowledge.state()))
        compError: c_status(?c, "FALSE") does not hold: nothing has a c_status; ...
    """

    base: Ontology
    _facts: dict[KnowledgeState, tuple[Facts, frozenset[Rule]] | str] = field(
        default_factory=dict, repr=False
    )

    def why_not(self, name: str, state: KnowledgeState) -> WhyNot:
        """Say why a rule does not fire in a state.

        Raises:
            InputError: there is no rule of that name.
        """
        answers = [self.of(rule, state) for rule in self.base.rules if rule.name == name]
        if not answers:
            known = sorted({rule.name for rule in self.base.rules})
            raise unknown(f"there is no rule {shown(name)}", name, known)
        return next((answer for answer in answers if answer.fires), answers[0])

    def of(
        self, rule: Rule, state: KnowledgeState, start: Binding = MappingProxyType({})
    ) -> WhyNot:
        """Say why a rule, which may share its name, does not fire where variables stand for what
        `start` says.
        """
        never = self._why_never(rule)
        if never is not None and rule not in self._usable.content.enabled_rules:
            return WhyNot(rule.name, never)
        known = self._known(state)
        if isinstance(known, str):
            return WhyNot(rule.name, f"nothing follows, as the state contradicts itself: {known}")
        facts, firing = known
        if rule not in firing and never is not None:
            return WhyNot(rule.name, never)
        binding, failing = nearest_match(rule, facts, start)
        if rule in firing and not (failing and start):
            return self._firing(rule, binding, is_known=not failing)
        if not failing:
            words = "it does not fire, though each atom of its body holds"
            return WhyNot(rule.name, words, failing=len(rule.body))
        return self._failing(rule, binding, failing, facts)

    def _firing(self, rule: Rule, binding: Binding, *, is_known: bool) -> WhyNot:
        """Tell with what a rule fires, if that is known, and what it concludes."""
        bindings = shown_bindings(binding, self.base.names) if is_known else ()
        said = ", ".join(self._concluded(atom, binding) for atom in rule.head)
        words = f"it fires{with_bindings(bindings)}, and concludes {said}"
        return WhyNot(rule.name, words, fires=True)

    def _why_never(self, rule: Rule) -> str | None:
        """Why a rule fires in no state, by the first problem in its text; None: there is none."""
        if not rule.enabled:
            return f"never fires: it is disabled (kb enable-rule {rule.name}, or remove --disable-rule)"
        for each in rule_problems(rule, self.base.vocabulary):
            return f"never fires: {each.message}" + (f"; {each.remedy}" if each.remedy else "")
        return f"never fires: {self._dropped[rule]}" if rule in self._dropped else None

    def _failing(
        self, rule: Rule, binding: Binding, failing: Sequence[int], facts: Facts
    ) -> WhyNot:
        """Tell the first atom that fails of the nearest match of a rule; what no state can bring
        comes first.
        """
        atoms = [rule.body[number] for number in failing]
        first = next(filter(self._is_fixed, atoms), atoms[0])
        reason = describe_failure(self._usable, first, binding, facts)
        others = len(failing) - 1
        more = f" ({others} more {'atom fails' if others == 1 else 'atoms fail'})" if others else ""
        chain = self._concluder(rule, first, binding, facts)
        answer = f"{write_atom(first)} does not hold: {reason}{more}{chain}"
        return WhyNot(rule.name, answer, failing=len(failing))

    def missing(self, triple: Triple, state: KnowledgeState) -> list[WhyNot]:
        """Say why no rule concludes a fact, of each that could; those that lack least first."""
        found = [
            self.of(rule, state, start)
            for rule in self.base.content.enabled_rules
            for start in islice(concluding(rule, [triple]), 1)
        ]
        found.sort(key=attrgetter("failing", "rule"))
        return [each for each in found if not each.fires]

    def _is_fixed(self, atom: Atom) -> bool:
        """Whether what an atom asks for is neither in states nor concluded by a rule."""
        content = self._usable.content
        of_states = {triple[1] for own in self._usable.model.own.values() for triple in own}
        return (
            atom.kind in FACT_KINDS
            and atom.predicate not in _IN_STATES | content.concluded | of_states
        )

    @cached_property
    def _dropped(self) -> dict[Rule, str]:
        """The enabled rules that Pellet drops, with its reasons."""
        try:
            return dropped_rules(self.base)
        except KnowledgeError:  # it cannot even read them
            known = self.base.vocabulary
            wrong = {one: fatal_problems(one, known) for one in self.base.content.enabled_rules}
            return {one: found[0].message for one, found in wrong.items() if found}

    @cached_property
    def _usable(self) -> Ontology:
        """The knowledge base without the rules that Pellet drops."""
        return self.base.with_rules(one for one in self.base.rules if one not in self._dropped)

    @cached_property
    def _pellet(self) -> InProcessPellet:
        bodies = [rule.body for rule in self._usable.content.enabled_rules]
        return tracing_pellet(self._usable, bodies)

    def _known(self, state: KnowledgeState) -> tuple[Facts, frozenset[Rule]] | str:
        """All that follows in a state and the rules that fire, or what contradicts what in it."""
        if state not in self._facts:
            try:
                self._facts[state] = self._asked_of_pellet(state)
            except ContradictionError as error:
                self._facts[state] = error.problem.removeprefix("contradiction: ")
        return self._facts[state]

    def _asked_of_pellet(self, state: KnowledgeState) -> tuple[Facts, frozenset[Rule]]:
        """All that follows in a state, and the rules that fire."""
        rules = self._usable.content.enabled_rules
        try:
            tracer = Tracer(self._usable, state, self._pellet)
            known = tracer.known
            facts = Facts(known)
            firing = {rules[number] for number in tracer.holding}
        except ContradictionError:
            raise
        except KnowledgeError:
            # Where rules ask what is different Pellet can fail on what it is asked besides.
            known = self._followed(rules, state)
            facts = Facts(known)
            firing = {rule for rule in rules if matches(rule, facts)}
        more = (rule for rule in rules if rule not in firing and self._adds(rule, state, known))
        return facts, frozenset([*firing, *more])

    def _followed(self, rules: Iterable[Rule], state: KnowledgeState) -> tuple[Triple, ...]:
        """All that follows in a state with some of the rules."""
        base = self._usable.with_rules(rules)
        return Tracer(base, state, tracing_pellet(base)).known

    def _adds(self, rule: Rule, state: KnowledgeState, known: Iterable[Triple]) -> bool:
        """Whether something that a rule concludes follows with it alone, of all that is known.

        It may fire with no match that is known: where an individual differs from one of two, but
        from which does not follow.
        """
        if not any(atom.predicate in IDENTITIES for atom in rule.body):
            return False
        rules = self._usable.content.enabled_rules
        fewer = self._followed((each for each in rules if each is not rule), state)
        more = set(known).difference(fewer)
        return next(concluding(rule, more), None) is not None

    def _concluded(self, atom: Atom, binding: Binding) -> str:
        fact = stated(atom, binding)
        return write_atom(atom) if fact is None else str(fact_of(fact, self.base.names))

    def _concluder(self, rule: Rule, atom: Atom, binding: Binding, facts: Facts) -> str:
        """The rule that comes nearest to concluding what is missing, and why it does not."""
        if atom.kind not in FACT_KINDS:
            return ""
        wanted = [bound(term, binding) for term in atom.arguments]
        found = []
        for other in self._usable.content.enabled_rules:
            for head in other.head if other is not rule else ():
                start = unified(head.arguments, wanted, {})
                if (head.kind, head.predicate) != (atom.kind, atom.predicate) or start is None:
                    continue
                nearest_one, failing = nearest_match(other, facts, start)
                if failing:
                    first = other.body[failing[0]]
                    reason = describe_failure(self._usable, first, nearest_one, facts)
                    why = f"its {write_atom(first)} fails: {reason}"
                    words = f"; {other.name} would conclude it, but {why}"
                    found.append((len(failing), other.name, words))
        if not found:
            return ""
        _, _, words = min(found)
        return words


def describe_failure(base: Ontology, atom: Atom, binding: Binding, facts: Facts) -> str:
    """Describe why an atom of a rule's body does not hold, with a binding, in all that follows."""
    if atom.kind == "different":
        return "OWL does not assume that different names mean different individuals: assert it"
    if atom.kind == "same":
        return "these individuals are not known to be the same"
    if atom.kind in FACT_KINDS:
        return _missing(base, atom, binding, facts)
    if atom.predicate in COMPARISONS and len(atom.arguments) == 2:
        return _compared(base, atom, binding)
    known = dict.fromkeys(name for name in atom.variables() if name in binding)
    texts = (f"?{name} = {_show(base, binding[name])}" for name in known)
    return f"it is false for {', '.join(texts) or 'these values'}"


def _missing(base: Ontology, atom: Atom, binding: Binding, facts: Facts) -> str:
    """Describe which fact is missing, and what is known in its place."""
    subject = bound(atom.arguments[0], binding)
    wanted = bound(atom.arguments[-1], binding)
    who = base.names.short(subject) if isinstance(subject, str) else ""
    name = local_name(atom.predicate)
    given = _GIVEN_BY_STATES.get(atom.predicate, "")
    if atom.kind == "class":
        return f"{who} is not known to be a {name}{given}" if who else f"there is no {name}{given}"
    values = facts.values(subject, atom.predicate)
    if not values:
        return f"{who} has no {name}{given}" if who else f"nothing has a {name}{given}"
    if wanted is not None:
        of = f" of {who}" if who else ""
        needed = f"needed {_show(base, wanted)}{_unequal(values, wanted)}"
        return f"found {name} {_list(base, values)}{of}, {needed}"
    if who:
        return f"{who} has {name} {_list(base, values)}, but not as the other atoms need it"
    return f"no {name} connects what the other atoms need"


def _compared(base: Ontology, atom: Atom, binding: Binding) -> str:
    sides = [bound(term, binding) for term in atom.arguments]
    texts = [
        _show(base, value) + (f" (?{term.name})" if isinstance(term, Variable) else "")
        for term, value in zip(atom.arguments, sides, strict=True)
    ]
    words = _WORDS[COMPARISONS[atom.predicate]]
    numbers = [value.datatype in NUMERIC for value in sides if isinstance(value, Lit)]
    if sorted(numbers) == [False, True]:
        text = texts[numbers.index(False)]
        number = texts[numbers.index(True)]
        return (
            f"{text} is text, and never compares with the number {number}; write it without quotes"
        )
    return f"found {texts[0]}, needed {words} {texts[1]}"


def _unequal(values: list[str | Lit], wanted: str | Lit) -> str:
    """Why values that look alike are not equal."""
    for value in values:
        if isinstance(value, Lit) and isinstance(wanted, Lit):
            if value.datatype != wanted.datatype:
                kinds = f"{local_name(value.datatype)} and {local_name(wanted.datatype)}"
                return (
                    f"; {kinds} never match, even where they look alike: write {write_term(value)}"
                )
            if value.text.strip().lower() == wanted.text.strip().lower():
                return "; they differ in case or spaces"
    return ""


def _show(base: Ontology, value: str | Lit | None) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, Lit):
        is_number = value.datatype in NUMERIC
        is_plain = is_number and str(value_of(value, base.names)) == value.text
        return value.text if is_plain else write_term(value)
    return base.names.short(value)


def _list(base: Ontology, values: list[str | Lit]) -> str:
    texts = sorted({_show(base, value) for value in values})
    return ", ".join(texts[:_MOST]) + (
        f" and {len(texts) - _MOST} more" if len(texts) > _MOST else ""
    )


#: How many rules are named for a fact that does not follow, and values where another one is needed.
_MOST = 3
_WHY = re.compile(r"why\s+(?:not\s+)?([^\s(?]+)\s*\??", re.IGNORECASE)
_FORMS = 'a fact such as fg_status(fg_spiral_high, IN_ERROR_NFR), "why fd_spiral_low?" or "why not fd_spiral_high?"'


CHOSEN, LEFT_OUT, NOT_BEST = "chosen", "left out", "not the best"


class Candidate(NamedTuple):
    """The planner's verdict on a function design: "chosen", "left out" or "not the best"; and
    why.
    """

    design: str
    verdict: str
    reason: str

    def __str__(self) -> str:
        return f"{self.design}: {self.verdict}: {self.reason}"


def verdicts(base: Ontology, reasoning: Reasoning, decision: Decision) -> Iterator[Candidate]:
    """Say of each design of a function, by name, what the planner made of it."""
    rejected = {each.design: each.reason for each in decision.rejected}
    for design in base.designs(decision.function):
        if design == decision.design:
            yield Candidate(design, CHOSEN, decision.reason)
        elif design in rejected:
            yield Candidate(design, LEFT_OUT, rejected[design])
        else:
            own = performance(reasoning.inference, design)
            best = performance(reasoning.inference, str(decision.design))
            reason = f"performance {own} < {best} of {decision.design}"
            if own == best:
                reason = f"performance {own}, as {decision.design}, which is first by name"
            yield Candidate(design, NOT_BEST, reason)


@dataclass(frozen=True)
class Explanation:
    """The answer to a question about a state.

    Attributes:
        facts: how they follow.
        decisions: of each function the lines that say why it gets its design, the answer first.
    """

    facts: tuple[Derivation, ...] = ()
    decisions: tuple[tuple[str, ...], ...] = ()

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def lines(self) -> Iterator[str]:
        """All of it, one fact or decision after the other."""
        for derivation in self.facts:
            yield from derivation.lines()
        for lines in self.decisions:
            yield from lines
        if not self.facts and not self.decisions:
            yield "nothing is inferred, and nothing is decided"


class Explainer:
    """Answers questions about a state.

    Args:
        reasoning: what is inferred of all terms and planned in the state.
        pellet: has the ontologies, and reads all terms.
    """

    def __init__(self, base: Ontology, reasoning: Reasoning, pellet: InProcessPellet) -> None:
        self.base, self.reasoning = base, reasoning
        self.tracer = tracer = Tracer(base, reasoning.inference.state, pellet)
        self.triples: dict[Fact, Triple] = {}
        for triple in sorted(
            tracer.entailed, key=lambda each: (each not in tracer.asserted, str(each))
        ):
            for fact in facts_of([triple], base.names):
                self.triples.setdefault(fact, triple)
        # Where several rules ask for what is the same or different, Pellet's inferences are not the
        # same each time.
        self.facts = sorted(reasoning.inference.facts & self.triples.keys(), key=str)

    def answer(self, question: str) -> Explanation:
        """Answer a question; see KnowledgeBase.explain."""
        question = question.strip()
        if why := _WHY.fullmatch(question):
            return Explanation(decisions=(self.design(why.group(1)),))
        if "(" in question:
            return Explanation((self.fact(question),))
        if question:
            raise InputError(f"{shown(question)} is not a question about a state", remedy=_FORMS)
        return Explanation(
            tuple(map(self.derive, self.facts)),
            tuple(map(self.decision, self.reasoning.plan.decisions)),
        )

    def derive(self, fact: Fact) -> Derivation:
        """How a fact follows."""
        return self.tracer.derive(self.triples[fact])

    def fact(self, text: str) -> Derivation:
        """How a fact follows that is written as an atom."""
        reader = FactReader(self.base)
        triple = reader.triple(text)
        if canonical_triple(triple) in self.tracer.known:
            return self.tracer.derive(triple)
        fact = reader.fact(text)  # a value that the property cannot have is refused
        values = [value for s, p, value in self.tracer.known if (s, p) == triple[:2]]
        texts = sorted(value_text(value_of(value, self.base.names)) for value in values)
        name = "type" if triple[1] == RDF_TYPE else local_name(triple[1])
        near = RuleQuestions(self.base).missing(triple, self.tracer.state)
        remedies = [f"{name} of {fact.subject}: {', '.join(texts) or 'none'}"]
        remedies += (f"rule {each}" for each in near[:_MOST])
        raise InputError(f"{fact} does not follow in this state", remedy="; ".join(remedies))

    def design(self, design: str) -> tuple[str, ...]:
        """Why a design is chosen or not."""
        function = self._solved_by(design)
        for decision in self.reasoning.plan.decisions:
            if decision.function == function:
                return self.decision(decision, design)
        state = self.reasoning.inference.state
        answer = f"the objective of {function} requires no adaptation, so {state.grounded(function) or 'it'} stays"
        if function not in {each.function for each in state.objectives}:
            answer = f"{function} has no objective in this state"
        return (f"{function}: nothing is decided: {answer}",)

    def _solved_by(self, design: str) -> str:
        """The function that a design solves."""
        for name in self.base.functions:
            if design in self.base.designs(name):
                return name
        known = [each for name in self.base.functions for each in self.base.designs(name)]
        raise unknown(f"there is no function design {shown(design)}", design, known)

    def decision(self, decision: Decision, asked: str | None = None) -> tuple[str, ...]:
        """Why a decision is made: the answer, which begins with the design that was asked about,
        and the reasons.
        """
        function = decision.function
        objective = self.base.objectives[function]
        answer = f"{decision.design}: {decision.reason}" if decision.design else decision.reason
        lines: list[str] = []
        for fact in self.facts:
            if fact.subject == objective and fact.property in ("o_status", "o_updatable"):
                lines += ["  adapted because", *self.derive(fact).lines("    ")]
        for each in verdicts(self.base, self.reasoning, decision):
            lines.append(f"  {each}")
            if each.verdict == LEFT_OUT:
                lines += self._why_left_out(each.design, objective)
            if each.design == asked:
                answer = f"{asked} is {each.verdict}: {each.reason}"
                if decision.design is None:
                    present = self.reasoning.inference.state.grounded(function) or function
                    answer = f"no design is left, {present} stays; {answer}"
        return f"{function}: {answer}", *lines

    def _why_left_out(self, design: str, objective: str) -> Iterator[str]:
        for fact in (
            Fact(design, "fd_realisability", False),
            Fact(design, "fd_error_log", objective),
        ):
            if fact in self.triples:
                yield from self.derive(fact).lines("    ")
