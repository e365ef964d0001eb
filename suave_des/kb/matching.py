"""Match the atoms of a rule's body with facts.

Atoms about facts are matched with what follows in a state. What a built-in says of given values, or
computes from them, is left to Pellet; the nearest match asks for it with a rule that has this one
atom.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import product
from types import MappingProxyType

from suave_des.kb.situations import Situation
from suave_des.knowledge.ontology import Content, Ontology, Terms
from suave_des.knowledge.pellet import LOADING, TimeLimit, reasoning_on
from suave_des.knowledge.pellet.in_process import InProcessPellet, entailed
from suave_des.knowledge.rdf import OWL, RDF_TYPE, XSD, Lit, Names, Triple, canonical, value_of
from suave_des.knowledge.rules import (
    FACT_KINDS,
    Atom,
    Named,
    Rule,
    Term,
    Variable,
    computed,
)
from suave_des.knowledge.state import ContradictionError, Value, value_text

#: Begins the IRIs of what is added to a knowledge base to question it.
PROBE = "urn:suave-des:probe"
_HOLDS = f"{PROBE}#holds"
_MEMBER = f"{PROBE}#member"

Body = tuple[Atom, ...]
#: What the variables of a rule stand for: IRIs and literals by name.
Binding = Mapping[str, str | Lit]
#: The same as people write it.
Bound = tuple[tuple[str, Value], ...]
#: A binding, and the numbers of the atoms that fail with it.
_Way = tuple[Binding, tuple[int, ...]]
_BINDING = ("class", "object", "data")
#: Ways to bind variables that are looked at for each number of atoms that fail.
MOST_WAYS = 20_000


def bound(term: Term, binding: Binding) -> str | Lit | None:
    """What a term stands for; None for a variable without a value."""
    if isinstance(term, Variable):
        return binding.get(term.name)
    return term.iri if isinstance(term, Named) else term


def instance(atom: Atom, binding: Binding) -> Atom:
    """An atom with the values of those variables that have one, and with literals in canonical
    form.
    """

    def value(term: Term) -> Term:
        found = bound(term, binding)
        if found is None:
            return term
        return canonical(found) if isinstance(found, Lit) else Named(found)

    return replace(atom, arguments=tuple(map(value, atom.arguments)), places=())


def unified(
    terms: Sequence[Term], values: Iterable[str | Lit | None], binding: Binding
) -> Binding | None:
    """Extend a binding so that terms have given values, None for any; None if they cannot."""
    found = dict(binding)
    for term, value in zip(terms, values, strict=False):
        if value is None:
            continue
        wanted = canonical(value)
        if isinstance(term, Variable):
            if found.setdefault(term.name, wanted) != wanted:
                return None
        elif canonical(term.iri if isinstance(term, Named) else term) != wanted:
            return None
    return found


def shown_bindings(binding: Binding, names: Names) -> Bound:
    """Return the values of variables as people write them, by the names of the variables in their
    order.
    """
    return tuple((name, value_of(binding[name], names)) for name in sorted(binding))


def with_bindings(bindings: Iterable[tuple[str, Value]]) -> str:
    """Write the values of variables after something that holds with them."""
    words = ", ".join(f"?{name} = {value_text(value)}" for name, value in bindings)
    return f" with {words}" if words else ""


def matched(atom: Atom, triple: Triple, binding: Binding) -> Binding | None:
    """Extend a binding so that an atom says a triple; None if it cannot."""
    subject, predicate, value = triple
    if atom.kind == "class":
        fits = predicate == RDF_TYPE and value == atom.predicate
        return unified(atom.arguments[:1], (subject,), binding) if fits else None
    fits = atom.kind in FACT_KINDS and predicate == atom.predicate
    return unified(atom.arguments, (subject, value), binding) if fits else None


def concluding(rule: Rule, triples: Iterable[Triple]) -> Iterator[Binding]:
    """The bindings with which a rule concludes one of some triples."""
    for atom, triple in product(rule.head, triples):
        if (found := matched(atom, triple, {})) is not None:
            yield found


def stated(atom: Atom, binding: Binding) -> Triple | None:
    """The triple that an atom says with the values of its variables; None where one has none, or
    for another atom.
    """
    terms = [bound(term, binding) for term in atom.arguments]
    if atom.kind not in FACT_KINDS or None in terms:
        return None
    subject, value = str(terms[0]), terms[-1] or ""
    if atom.kind == "class":
        return subject, RDF_TYPE, atom.predicate
    return subject, atom.predicate, value


class Facts:
    """What follows in a state, to be looked up by property or class, and subject."""

    def __init__(self, known: Iterable[Triple]) -> None:
        self._index = defaultdict[tuple[str, str | None], list[Triple]](list)
        for subject, predicate, value in known:
            name = str(value) if predicate == RDF_TYPE else predicate
            for key in ((name, subject), (name, None)):
                self._index[key].append((subject, predicate, canonical(value)))

    def of(self, name: str, subject: str | Lit | None = None) -> Sequence[Triple]:
        """The triples of a property or class, about one subject; None: about any."""
        return self._index.get((name, subject if isinstance(subject, str) else None), ())

    def __contains__(self, triple: Triple) -> bool:
        """Whether a triple, in canonical form, follows."""
        return triple in self.of(str(triple[2]) if triple[1] == RDF_TYPE else triple[1], triple[0])

    def matches(self, atom: Atom, binding: Binding) -> Iterator[Binding]:
        """Extend a binding in each way in which an atom says a fact."""
        for triple in self.of(atom.predicate, bound(atom.arguments[0], binding)):
            if (found := matched(atom, triple, binding)) is not None:
                yield found

    def values(self, subject: str | Lit | None, predicate: str) -> list[str | Lit]:
        """Values of a property of an individual; None: of all of them."""
        return list(dict.fromkeys(value for _, _, value in self.of(predicate, subject)))


def matches(rule: Rule, facts: Facts, start: Binding = MappingProxyType({})) -> list[Binding]:
    """All bindings with which the whole body of a rule holds, and which extend one, in a fixed
    order.
    """
    body = _canonical_body(rule)
    ways = _ways(body, testable_order(body), facts, start, iter(range(MOST_WAYS)))
    return sorted((binding for binding, _ in ways), key=str)


def nearest_match(rule: Rule, facts: Facts, start: Binding = MappingProxyType({})) -> _Way:
    """Find the extended binding with the fewest atoms of a rule's body that fail, and their
    numbers.

    Of several, one where a comparison fails comes before one where a value differs, and that before
    one where nothing is known. Atoms of which there is no fact at all fail in any case.
    """
    body = _canonical_body(rule)

    def rank(way: _Way) -> tuple[object, ...]:
        binding, failing = way
        distances = [(_distance(body[number], facts, binding), -number) for number in failing]
        return distances, str(sorted(binding.items()))

    hopeless = {
        number
        for number, atom in enumerate(body)
        if atom.kind in FACT_KINDS and not any(True for _ in facts.matches(atom, start))
    }
    order = [number for number in testable_order(body) if number not in hopeless]
    for allowed in range(len(order) + 1):
        ways = list(_ways(body, order, facts, start, iter(range(MOST_WAYS)), allowed))
        if ways:
            binding, failing = min(ways, key=rank)
            return binding, tuple(sorted({*failing, *hopeless}))
    return start, tuple(range(len(body)))


def _ways(
    body: Sequence[Atom],
    order: Sequence[int],
    facts: Facts,
    binding: Binding,
    tries: Iterator[int],
    allowed: int = 0,
) -> Iterator[_Way]:
    """Ways to match atoms, in an order, of which some may fail: binding, and numbers of those; as
    many as `tries`.
    """
    if next(tries, None) is None:
        return
    if not order:
        yield binding, ()
        return
    number, rest = order[0], order[1:]
    atom = body[number]
    is_fact = atom.kind in FACT_KINDS
    results = facts.matches(atom, binding) if is_fact else _tested(atom, binding)
    # A variable without a value is one of an atom that fails already.
    for found in [binding] if results is None else results:
        yield from _ways(body, rest, facts, found, tries, allowed)
    # The fact that is missing may be the only thing wrong, with another binding.
    if allowed and (is_fact or results == []):
        for found, failing in _ways(body, rest, facts, binding, tries, allowed - 1):
            yield found, (number, *failing)


def _tested(atom: Atom, binding: Binding) -> list[Binding] | None:
    """The bindings with which a built-in or datatype holds; None if an argument has no value."""
    asked = instance(atom, binding)
    unbound = list(asked.variables())
    if not unbound:
        return [binding] if _holds(asked) else []
    if not set(unbound) <= computed(atom, binding):
        return None
    if isinstance(asked.arguments[0], Variable) and len(set(unbound)) == 1:
        return [{**binding, unbound[0]: canonical(value)} for value in _computed(asked, unbound[0])]
    parts = [value for name in unbound for value in _computed(asked, name)]
    if len(parts) != len(unbound):
        return []
    return [{**binding, **dict(zip(unbound, map(canonical, parts), strict=True))}]


def _distance(atom: Atom, facts: Facts, binding: Binding) -> int:
    """How far an atom is from holding: a comparison, another value, nothing, a class."""
    if atom.kind not in FACT_KINDS:
        return 0
    if atom.kind == "class":
        return 3
    subject = bound(atom.arguments[0], binding)
    return 1 if isinstance(subject, str) and facts.of(atom.predicate, subject) else 2


def _canonical_body(rule: Rule) -> list[Atom]:
    return [instance(atom, {}) for atom in rule.body]


def testable_order(body: Sequence[Atom]) -> list[int]:
    """Order atoms as the rule does, but those that test or compute after all that bind their
    variables.
    """
    waiting = list(range(len(body)))
    known: set[str] = set()
    order = []
    while waiting:
        ready = (
            number
            for number in waiting
            if body[number].kind in _BINDING or _is_testable(body[number], known)
        )
        number = next(ready, waiting[0])
        waiting.remove(number)
        order.append(number)
        known |= set(body[number].variables())
    return order


def _is_testable(atom: Atom, known: set[str]) -> bool:
    """Whether an atom can be tested, or what it computes be computed, where variables have
    values.
    """
    return set(atom.variables()) <= known | computed(atom, known)


_IT = Named(f"{PROBE}#it")
_VALUE = f"{PROBE}#value"


@lru_cache(maxsize=4096)
def _holds(atom: Atom) -> bool:
    """Whether Pellet says that a built-in or datatype holds for values."""
    head = Atom("data", _VALUE, (_IT, Lit("true", XSD + "boolean")))
    return bool(_concluded((), (atom,), head))


@lru_cache(maxsize=4096)
def _computed(atom: Atom, name: str) -> tuple[Lit, ...]:
    """What Pellet computes for a variable: the first argument, or a part of a date."""
    given, body = _from_variables(atom)
    return _concluded(given, body, Atom("data", _VALUE, (_IT, Variable(name))))


def _from_variables(atom: Atom) -> tuple[tuple[Triple, ...], tuple[Atom, ...]]:
    """Facts and a body that give the values of an atom to variables: some are computed from these
    only.
    """
    given: list[Triple] = []
    body = []
    terms = []
    for number, term in enumerate(atom.arguments):
        if isinstance(term, Lit):
            name, variable = f"{PROBE}#argument{number}", Variable(f"argument {number}")
            given += [(name, RDF_TYPE, OWL + "DatatypeProperty"), (_IT.iri, name, term)]
            body.append(Atom("data", name, (_IT, variable)))
            term = variable
        terms.append(term)
    return tuple(given), (*body, replace(atom, arguments=tuple(terms)))


def _concluded(given: Sequence[Triple], body: Body, head: Atom) -> tuple[Lit, ...]:
    """The values that Pellet concludes from facts with one rule."""
    rule = Rule("probe", body, (head,))
    triples = ((_IT.iri, RDF_TYPE, OWL + "Thing"), *given)
    found = entailed(Content(triples, (), (rule,)).n_triples(), [head])
    return tuple(sorted(value for _, _, value in found if isinstance(value, Lit)))


def _expressions(base: Ontology) -> dict[str, Atom]:
    """The class expressions that rules ask for, each by a class that stands for it."""
    asked = {
        replace(atom, arguments=(Variable("x"),), places=()): None
        for rule in base.content.enabled_rules
        for atom in rule.body
        if atom.kind == "class" and atom.expression
    }
    return {f"{_MEMBER}{number}": atom for number, atom in enumerate(asked)}


def tracing_pellet(base: Ontology, bodies: Sequence[Body] = ()) -> InProcessPellet:
    """Pellet that reads all terms, the members of the class expressions that rules ask for, and
    which bodies of rules hold; see told_of.

    Raises:
        KnowledgeError: Pellet cannot use the knowledge base.
    """
    members = _expressions(base)
    rules = [
        Rule("", (atom,), (Atom("class", name, (Variable("x"),)),))
        for name, atom in members.items()
    ]
    rules += _probes(bodies)
    properties, classes = base.content.all_terms()
    terms = Terms((*properties, _HOLDS), (*classes, *members))
    return InProcessPellet(base.with_rules((*base.rules, *rules)), terms)


def told_of(base: Ontology, triples: Iterable[Triple]) -> tuple[frozenset[Triple], frozenset[int]]:
    """Separate what a Pellet of tracing_pellet infers: all that follows, and the numbers of the
    bodies that hold.
    """
    members = {name: atom.predicate for name, atom in _expressions(base).items()}
    known = set()
    numbers = set()
    for subject, predicate, value in triples:
        if predicate == _HOLDS and isinstance(value, Lit):
            numbers.add(int(value.text))
        elif _IT.iri not in (subject, value):  # which the probes alone have
            known.add((subject, predicate, members.get(str(value), value)))
    return frozenset(known), frozenset(numbers)


class Probes:
    """Asks Pellet which conjunctions of atoms hold.

    Each is the body of a separate rule, whose head has an individual and a property that nothing
    else mentions, so that it changes nothing.

    Args:
        limit: of Pellet's time for one situation.
        bodies: the conjunctions; each must be safe, as the body of a rule is.

    Raises:
        KnowledgeError: Pellet cannot use them.
    """

    def __init__(self, base: Ontology, limit: TimeLimit, bodies: Iterable[Body]) -> None:
        self._base, self._limit, self._bodies = base, limit, tuple(dict.fromkeys(bodies))
        probed = base.with_rules((*base.rules, *_probes(self._bodies)))
        self._pellet = limit.run(lambda: InProcessPellet(probed), LOADING)

    def holding(self, situation: Situation) -> frozenset[Body] | None:
        """Return the conjunctions that hold; None for a situation that contradicts itself.

        Raises:
            KnowledgeError: Pellet takes too long.
        """
        asserted = (*self._base.assertions(situation.state), *situation.facts)
        try:
            found = self._limit.run(
                lambda: self._pellet.infer(asserted), reasoning_on(situation.state)
            )
        except ContradictionError:
            return None
        numbers = (
            value.text for _, name, value in found if name == _HOLDS and isinstance(value, Lit)
        )
        return frozenset(self._bodies[int(number)] for number in numbers)


def _probes(bodies: Sequence[Body]) -> Iterator[Rule]:
    """Rules that conclude the numbers of the bodies that hold."""
    for number, body in enumerate(bodies):
        head = Atom("data", _HOLDS, (_IT, Lit(str(number), XSD + "string")))
        yield Rule(f"probe {number}", body, (head,))
