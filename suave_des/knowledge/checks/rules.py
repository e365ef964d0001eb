"""Checks of the rules: well-formed ones, too, that cannot mean what their author wanted."""

from __future__ import annotations

import operator
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from itertools import chain, pairwise
from pathlib import Path
from typing import Final

from suave_des.errors import nearest, similar, with_article
from suave_des.findings import Finding, Level
from suave_des.knowledge.checks.model import (
    Kinds,
    dead_rules,
    rules_for_other_models,
    rules_of_2023,
    undeclared_differences,
    unmeasured_rules,
)
from suave_des.knowledge.checks.registry import Found, Material, Subject, check, run_checks
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import is_metamodel
from suave_des.knowledge.rdf import (
    C_STATUS,
    NUMERIC,
    TOMASYS,
    XSD,
    Lit,
    canonical,
    local_name,
    number_in,
)
from suave_des.knowledge.rules import (
    COMPARISON_OF,
    COMPARISONS,
    Atom,
    Named,
    Place,
    Rule,
    Term,
    Variable,
    literal_text,
    mirrored,
    write_atom,
)
from suave_des.knowledge.rules.checks import fatal_problems
from suave_des.knowledge.rules.files import WITHOUT_NAME

_FD_REALISABILITY: Final = TOMASYS + "fd_realisability"
_COMPARE: Final[Mapping[str, Callable[[float, float], bool]]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


@check(Level.ERROR)
def mistakes_that_pellet_ignores(material: Material) -> Iterator[Found]:
    """Find what Pellet would drop or ignore without a word."""
    skipped = set(map(id, rules_for_other_models(material)))
    for rule in material.rules:
        for each in fatal_problems(rule, material.base.vocabulary) if id(rule) not in skipped else ():
            place = Place(each.line or 1, each.column) if each.column else None
            yield rule, place, each.message, each.remedy


@check(Level.WARN)
def shared_names(material: Material) -> Iterator[Found]:
    """Find rules of one name, other than those of TOMASys and mros."""
    names = Counter(rule.name for rule in material.content.rules)
    sources = {rule.file: material.base.source_of(rule) for rule in material.content.rules}
    others = {path for path, source in sources.items() if source is not None and is_metamodel(source)}
    own = {rule.name for rule in material.content.rules if rule.file not in others}
    for rule in material.content.rules:
        if names[rule.name] > 1 and rule.name in own and not rule.name.endswith(WITHOUT_NAME):
            yield rule, None, f"{names[rule.name]} rules have this name", "rename one"


@check(Level.INFO)
def for_other_models(material: Material) -> Iterator[Found]:
    """Note the rules of TOMASys and mros that need what this model does not have, a file in one line."""
    by_file: dict[Path, list[str]] = defaultdict(list)
    for rule in rules_for_other_models(material):
        by_file[rule.file].append(rule.name)
    for file, names in by_file.items():
        yield file, None, f"rules for other models, which never fire in this one: {', '.join(names)}", None


@check(Level.WARN)
def never_fires(material: Material) -> Iterator[Found]:
    """Find rules with an atom that can hold in no state, or that need a value that nothing has."""
    content, model = material.content, material.base.model
    skipped = set(map(id, rules_for_other_models(material)))
    found = [(rule, atom, f"{write_atom(atom)} holds in no state", None) for rule, atom in dead_rules(content, model)]
    for rule, atom, problem, remedy in (*found, *unmeasured_rules(content, model, material.subject.measured)):
        if id(rule) not in skipped:
            skipped.add(id(rule))
            yield rule, atom.place(), f"can never fire: {problem}", remedy


@check(Level.WARN)
def equal_individuals(material: Material) -> Iterator[Found]:
    """Find rules that ask for different individuals, where nothing makes any different."""
    remedy = "add owl:AllDifferent to the ontology (Protégé: Different Individuals)"
    for rule, atom in undeclared_differences(material.content):
        problem = f"{write_atom(atom)} needs individuals that are declared different; different names are not enough"
        yield rule, atom.place(), problem, remedy


@check(Level.WARN)
def things_of_two_kinds(material: Material) -> Iterator[Found]:
    """Find variables and individuals that a rule would have to be of two kinds at once."""
    kinds = Kinds(material.content, material.base.model)
    for rule in material.rules:
        known: dict[Term, tuple[str, str]] = {}
        reported: set[Term] = set()
        for atom, term, kind in kinds.uses(rule):
            name = local_name(atom.predicate)
            if isinstance(term, Named) and term not in known and (own := kinds.of.get(term.iri)):
                known[term] = min(own), ""
            before, by = known.setdefault(term, (kind, "" if atom.kind == "class" else name))
            if kind != before and term not in reported:
                reported.add(term)
                thing = f"?{term.name}" if isinstance(term, Variable) else local_name(getattr(term, "iri", ""))
                first = with_article(local_name(before)) + (f" in {by}" if by else "")
                problem = f"{thing} is {first}, but {with_article(local_name(kind))} in {name}"
                yield rule, atom.place(), problem, None


@check(Level.WARN)
def misspelt_variables(material: Material) -> Iterator[Found]:
    """Find variables that occur once, and whose name is nearly that of another."""
    for rule in material.rules:
        places: dict[str, list[Place | None]] = defaultdict(list)
        values: dict[str, set[bool]] = defaultdict(set)
        for atom in rule.atoms:
            for number, term in enumerate(atom.arguments):
                if isinstance(term, Variable):
                    values[term.name].add(atom.takes_value(number))
                    places[term.name].append(atom.place(number))
        names = list(places)
        for name in (each for each in names if len(places[each]) == 1):
            near = [other for other in names if values[other] & values[name] and are_near(name, other)]
            before = names[: names.index(name)]
            meant = [other for other in near if len(places[other]) > 1] or [other for other in near if other in before]
            if meant:
                problem = f"?{name} occurs only here, and is another variable than ?{meant[0]}"
                yield rule, places[name][0], problem, f"did you mean ?{meant[0]}?"


def are_near(one: str, other: str) -> bool:
    """Whether one name is probably a misspelling of the other: in its capitals, or in letters inside it.

    Names that differ in a digit, in their first letter or in their last one are often meant: ?speed1 and ?speed2,
    ?xpos and ?ypos, ?design and ?design_b.
    """
    if one.casefold() == other.casefold():
        return one != other
    has_same_ends = one[0] == other[0] and (one[-1] == other[-1] or sorted(one) == sorted(other))
    is_word = (one + other).isalpha() and (one + other).islower() and min(len(one), len(other)) > 2
    return has_same_ends and is_word and similar(one, [other], cutoff=0.8) is not None


@check(Level.WARN)
def two_values(material: Material) -> Iterator[Found]:
    """Find what a rule asks, or concludes, to have two values of a property that has one."""
    for rule in material.rules:
        values: dict[tuple[str, Term], Term] = {}
        for atom in rule.body:
            if atom.predicate in material.functional and len(atom.arguments) == 2:
                subject, value = atom.arguments
                before = values.setdefault((atom.predicate, subject), value)
                if not isinstance(before, Variable) and not isinstance(value, Variable) and not _same(before, value):
                    name = local_name(atom.predicate)
                    problem = f"{write_atom(atom)}: nothing has two values of {name}, so the rule never fires"
                    yield rule, atom.place(), problem, "write a rule for each value"
        equated = {term for atom in rule.body if COMPARISONS.get(atom.predicate) == "=" for term in atom.arguments}
        for atom in rule.head:
            asked = values.get((atom.predicate, atom.arguments[0])) if len(atom.arguments) == 2 else None
            if asked is None or asked in equated or atom.kind != "data" or _same(asked, atom.arguments[1]):
                continue
            problem = f"{write_atom(atom)} contradicts {local_name(atom.predicate)} in the body, which holds as well"
            yield rule, atom.place(), problem, "rules add facts, and change none"


def _same(one: Term, other: Term) -> bool:
    return one == other or (isinstance(one, Lit) and isinstance(other, Lit) and canonical(one) == canonical(other))


@check(Level.WARN)
def no_effect(material: Material) -> Iterator[Found]:
    """Find rules that conclude that a design is realisable, which no decision asks."""
    is_asked = any(atom.predicate == _FD_REALISABILITY for rule in material.rules for atom in rule.body)
    for rule in material.rules:
        for atom in rule.head:
            term = atom.arguments[-1] if atom.predicate == _FD_REALISABILITY and not is_asked else None
            if isinstance(term, Lit) and term.text in ("true", "1"):
                problem = "fd_realisability true has no effect: a design counts as realisable unless it is false"
                yield rule, atom.place(), problem, "write the opposite condition, and conclude false"


@check(Level.WARN)
def comparisons_that_decide_nothing(material: Material) -> Iterator[Found]:
    """Find comparisons that no value satisfies, alone or together, and those with a text that none is."""
    vocabulary = material.base.vocabulary
    for rule in material.rules:
        holders = dict(rule.read_values())
        asked: dict[str, list[tuple[str, float, str]]] = defaultdict(list)  # sign, number, how it is written
        for atom, name, sign, value in _comparisons(rule):
            holder = holders.get(name, "")
            values = vocabulary.enumerations.get(holder)
            if values is not None and sign in ("=", "!=") and value.text not in values:
                holds, where = "never" if sign == "=" else "always", local_name(holder)
                problem = f"{literal_text(value)} is not among the values of {where}: the comparison {holds} holds"
                remedy = nearest(value.text, values) or f"one of {', '.join(sorted(values))}"
                yield rule, atom.place(), problem, remedy
            ranges = vocabulary.ranges.get(holder, frozenset())
            if sign != "!=" and ranges and ranges <= NUMERIC and value.datatype not in NUMERIC:
                compares = f"{local_name(COMPARISON_OF[sign])} compares ?{name}, a number"
                problem = f"{compares}, with the text {literal_text(value)}: it never holds"
                yield rule, atom.place(), problem, f"write {value.text} without quotes"
            elif (number := number_in(value)) is not None:
                asked[name].append((sign, float(number), f"{sign} {value.text}"))
                if not _is_possible(asked[name]):
                    problem = f"no value of ?{name} is {' and '.join(words for *_, words in asked[name])}"
                    yield rule, atom.place(), f"{problem}: the rule never fires", "reverse one of the comparisons"
                    asked[name].clear()


def _comparisons(rule: Rule) -> Iterator[tuple[Atom, str, str, Lit]]:
    """(comparison, variable, sign, literal) of each comparison with a literal, as if the variable were on the left."""
    for atom in rule.body:
        sign = COMPARISONS.get(atom.predicate)
        if sign is not None and len(atom.arguments) == 2:
            one, other = atom.arguments
            if isinstance(one, Variable) and isinstance(other, Lit):
                yield atom, one.name, sign, other
            elif isinstance(one, Lit) and isinstance(other, Variable):
                yield atom, other.name, mirrored(sign), one


def _is_possible(asked: Iterable[tuple[str, float, str]]) -> bool:
    """Whether a number satisfies all comparisons: one of theirs, one between two of them, or one beyond them."""
    numbers = sorted({number for _, number, _ in asked})
    tried = [numbers[0] - 1.0, *numbers, numbers[-1] + 1.0, *((low + high) / 2.0 for low, high in pairwise(numbers))]
    return any(all(_COMPARE[sign](each, number) for sign, number, _ in asked) for each in tried)


@check(Level.WARN)
def misspelt_statuses(material: Material) -> Iterator[Found]:
    """Find the user's rules that ask for a component's status that is nearly one that the simulation reports.

    Statuses that an ontology asserts, or a rule concludes, are known as well.
    """
    reported = {*chain.from_iterable((material.subject.reported or {}).values())}
    by_capitals = {each.upper(): each for each in sorted(reported)}
    asserted = [value for _, predicate, value in material.content.triples if predicate == C_STATUS]
    heads = [atom.arguments[-1] for rule in material.rules for atom in rule.head if atom.predicate == C_STATUS]
    known = {*reported, *(value.text for value in (*asserted, *heads) if isinstance(value, Lit))}
    for rule in filter(material.is_own, material.rules):
        asked = [(atom, atom.arguments[-1]) for atom in rule.body if atom.predicate == C_STATUS]
        statuses = {status for _, status in asked if isinstance(status, Variable)}
        for atom in rule.body:  # and in a comparison
            if atom.predicate in (COMPARISON_OF["="], COMPARISON_OF["!="]) and not statuses.isdisjoint(atom.arguments):
                asked += [(atom, term) for term in atom.arguments]
        for atom, status in asked:
            if isinstance(status, Lit) and status.datatype == XSD + "string" and status.text not in known:
                meant = similar(status.text.upper(), by_capitals)
                if meant is not None:
                    problem = f'nothing in the simulation reports c_status "{status.text}"'
                    yield rule, atom.place(1), problem, f'did you mean "{by_capitals[meant]}"?'


@check(Level.INFO)
def status_updatable(material: Material) -> Iterator[Found]:
    """Note the rules that conclude the status UPDATABLE."""
    for rule, atom in rules_of_2023(material.content):
        problem = "contradicts any other status that an objective has in the same state; the files of 2023 do so"
        yield rule, atom.place(), f"{write_atom(atom)} {problem}", "later files conclude o_updatable(?o, true)"


def findings_on_rule(
    name: str, base: Ontology, reported: Mapping[str, Collection[str]], measured: Collection[str]
) -> Iterator[Finding]:
    """Find what is wrong with the rules of a name in a knowledge base.

    Args:
        name: of the rules.
        base: the knowledge base that has them.
        reported: the statuses that the simulation reports, by component.
        measured: the quality attributes that the scenario measures.
    """
    files = [rule.file for rule in base.rules if rule.name == name]
    material = Material(Subject(rules=files, reported=reported, measured=measured), base)
    return (each for each in run_checks(material) if each.rule == name)
