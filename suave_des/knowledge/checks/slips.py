"""Check rules for slips: rules that are well-formed, and that cannot mean what their author wanted."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterator
from typing import Final, NamedTuple

from suave_des.knowledge.checks.kinds import Kinds, uses, with_article
from suave_des.knowledge.content import Content
from suave_des.knowledge.rdf import OWL, RDF_TYPE, TOMASYS, Lit, canonical, local_name
from suave_des.knowledge.rules.syntax import COMPARISONS, Atom, Place, Rule, Term, Variable
from suave_des.knowledge.rules.writer import write_atom

_FD_REALISABILITY: Final = TOMASYS + "fd_realisability"
#: Lengths of names from which they count as misspelt if one letter is added, missing or another.
_LONG: Final = 4


class Slip(NamedTuple):
    """What is wrong in a rule, where, and what would be right, if that is known."""

    rule: Rule
    message: str
    place: Place | None
    remedy: str | None = None


def slips(content: Content, kinds: Kinds) -> Iterator[Slip]:
    """Find the slips in the enabled rules."""
    functional = {
        subject for subject, name, value in content.triples if name == RDF_TYPE and value == OWL + "FunctionalProperty"
    }
    is_asked = any(atom.predicate == _FD_REALISABILITY for rule in content.enabled_rules for atom in rule.body)
    for rule in content.enabled_rules:
        apart = list(_unconnected(rule, kinds))
        yield from apart
        if not apart:
            yield from _nearly_the_same(rule)
        yield from _two_values(rule, functional)
        yield from _compared_with_itself(rule, functional)
        yield from _nothing_new(rule)
        if not is_asked:
            yield from _realisable(rule)


def _counts(rule: Rule) -> Counter[str]:
    return Counter(name for atom in rule.atoms for name in atom.variables())


def _unconnected(rule: Rule, kinds: Kinds) -> Iterator[Slip]:
    """Find what a property leads to without any use, while another thing of its kind is connected with nothing.

    Names that differ in capitals are left to check_rule, and what the same property leads to is meant to be another.
    """
    group: dict[str, set[str]] = {}
    for atom in rule.body:
        together = set(atom.variables()).union(*(group.get(name, ()) for name in atom.variables()))
        group |= dict.fromkeys(together, together)
    counts = _counts(rule)
    found: dict[str, tuple[str, Atom, Term]] = {}
    for atom, term, kind in uses(rule, kinds):
        if isinstance(term, Variable) and term.name in group:
            found.setdefault(term.name, (kind, atom, term))
    led_to = {(atom.predicate, term) for atom, term, _ in uses(rule, kinds) if _is_value(atom, term)}
    for name, (kind, atom, term) in found.items():
        apart = [other for other in found if found[other][0] == kind and other not in group[name]]
        apart = [other for other in apart if (atom.predicate, found[other][2]) not in led_to]
        alike = [other for other in apart if other.casefold() != name.casefold()]
        if counts[name] == 1 and alike and _is_value(atom, term):
            what = f"?{alike[0]}, which is {with_article(kind)}, too"
            problem = f"?{name} occurs only here, and nothing connects it with {what}"
            yield Slip(rule, problem, atom.place(1), f"did you mean ?{alike[0]}?")


def _is_value(atom: Atom, term: Term) -> bool:
    return atom.kind == "object" and atom.arguments[1] == term


def _nearly_the_same(rule: Rule) -> Iterator[Slip]:
    """Find variables that occur once, and whose name is another one's but for a letter."""
    counts, values = _counts(rule), defaultdict[str, set[bool]](set)
    places: dict[str, Place | None] = {}
    for atom in rule.atoms:
        for number, term in enumerate(atom.arguments):
            if isinstance(term, Variable):
                values[term.name].add(atom.takes_value(number))
                places[term.name] = atom.place(number)
    for name in (each for each, count in counts.items() if count == 1):
        near = [other for other in counts if values[other] & values[name] and are_near(name, other)]
        meant = [other for other in near if counts[other] > 1] or [other for other in near if other < name]
        if meant:
            problem = f"?{name} occurs only here, and is another variable than ?{meant[0]}"
            yield Slip(rule, problem, places[name], f"did you mean ?{meant[0]}?")


def are_near(one: str, other: str) -> bool:
    """Whether one name is probably a misspelling of the other.

    Names that differ in a digit, in their first letter or in a letter or two at their end are often meant:
    ?speed1 and ?speed2, ?xpos and ?ypos, ?design and ?design_b.
    """
    short, long = sorted((one, other), key=len)
    if len(short) < _LONG - 1 or short == long:
        return False
    differing = [place for place, (a, b) in enumerate(zip(short, long, strict=False)) if a != b]
    if len(short) == len(long):
        if len(differing) == 2 and differing[1] == differing[0] + 1:  # two letters are exchanged
            first, second = differing
            return short[first] == long[second] and short[second] == long[first] and short.isalpha()
        place = differing[0]
        is_inside = 0 < place < len(short) - 1
        return len(differing) == 1 and len(short) >= _LONG and is_inside and (short[place] + long[place]).islower()
    if len(long) > len(short) + 1:
        return False
    place = differing[0] if differing else len(short)
    is_inside = 0 < place < len(short) or long[place] == long[place - 1]
    return short[place:] == long[place + 1 :] and is_inside and long[place].islower() and len(short) >= _LONG - 1


def _two_values(rule: Rule, functional: Collection[str]) -> Iterator[Slip]:
    """Find what a rule asks, or concludes, to have two values of a property that has one."""
    values: dict[tuple[str, Term], Term] = {}
    for atom in rule.body:
        if atom.predicate in functional and len(atom.arguments) == 2:
            subject, value = atom.arguments
            before = values.setdefault((atom.predicate, subject), value)
            if not isinstance(before, Variable) and not isinstance(value, Variable) and not _same(before, value):
                name = local_name(atom.predicate)
                problem = f"{write_atom(atom)}: nothing has two values of {name}, so the rule never fires"
                yield Slip(rule, problem, atom.place(), "write a rule for each value")
    equated = {term for atom in rule.body if COMPARISONS.get(atom.predicate) == "=" for term in atom.arguments}
    for atom in rule.head:
        asked = values.get((atom.predicate, atom.arguments[0])) if len(atom.arguments) == 2 else None
        if asked is None or asked in equated or atom.kind != "data":
            continue
        if not _same(asked, atom.arguments[1]):
            name = local_name(atom.predicate)
            problem = f"{write_atom(atom)} contradicts {name} in the body, which holds as well"
            yield Slip(rule, problem, atom.place(), "rules add facts, and change none")


def _same(one: Term, other: Term) -> bool:
    return one == other or (isinstance(one, Lit) and isinstance(other, Lit) and canonical(one) == canonical(other))


def _compared_with_itself(rule: Rule, functional: Collection[str]) -> Iterator[Slip]:
    """Find comparisons of a value with itself."""
    holders: dict[str, tuple[str, Term]] = {}
    for atom in rule.body:
        if atom.predicate in functional and atom.kind == "data" and isinstance(atom.arguments[-1], Variable):
            holders.setdefault(atom.arguments[-1].name, (atom.predicate, atom.arguments[0]))
    for atom in rule.body:
        sign = COMPARISONS.get(atom.predicate)
        terms = [term for term in atom.arguments if isinstance(term, Variable)]
        if sign is None or len(terms) != 2:
            continue
        one, other = terms
        holds = "always" if sign in ("=", "<=", ">=") else "never"
        if one == other:
            yield Slip(rule, f"{write_atom(atom)} compares ?{one.name} with itself: it {holds} holds", atom.place())
        elif one.name in holders and holders[one.name] == holders.get(other.name):
            name = local_name(holders[one.name][0])
            problem = f"?{one.name} and ?{other.name} are the same {name}: {write_atom(atom)} {holds} holds"
            yield Slip(rule, problem, atom.place(), "they need two different individuals")


def _nothing_new(rule: Rule) -> Iterator[Slip]:
    """Find rules that conclude only what they ask; those of one atom are placeholders."""
    if rule.head and len(rule.body) > 1 and all(atom in rule.body for atom in rule.head):
        yield Slip(rule, "the rule concludes only what its body says", rule.head[0].place())


def _realisable(rule: Rule) -> Iterator[Slip]:
    """Find rules that conclude that a design is realisable, which no decision and no rule asks."""
    for atom in rule.head:
        if atom.predicate == _FD_REALISABILITY and _is_true(atom.arguments[-1]):
            problem = "fd_realisability true has no effect: a design counts as realisable unless it is false"
            yield Slip(rule, problem, atom.place(), "write the opposite condition, and conclude false")


def _is_true(term: Term) -> bool:
    return isinstance(term, Lit) and term.text in ("true", "1")
