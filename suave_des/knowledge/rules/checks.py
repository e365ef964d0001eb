"""Checks of rules: mistakes that Pellet silently drops or ignores, or that no reasoner could use.

Which mistakes Pellet ignores was found by giving it each of them (owlready2 0.51's Pellet).
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from decimal import Decimal
from operator import gt, lt
from typing import Final

from suave_des.errors import KnowledgeError, nearest
from suave_des.knowledge.rdf import NUMERIC, OWL, RDF_TYPE, XSD, Lit, Triple, local_name, reached
from suave_des.knowledge.rules.names import Vocabulary
from suave_des.knowledge.rules.syntax import (
    BUILTINS,
    COMPARISON_OF,
    COMPARISONS,
    EXPRESSION,
    TESTERS,
    Atom,
    Named,
    Place,
    Rule,
    RuleError,
    Term,
    Variable,
    mirrored,
)
from suave_des.knowledge.rules.writer import literal_text

_DECLARED_AS: Final = {"class": "class", "object": "object property", "data": "data property"}
_ARGUMENTS: Final = {"class": 1, "range": 1, "object": 2, "data": 2, "same": 2, "different": 2}
#: What a comparison with a number says of the value on its left, by its sign.
_BOUNDS: Final = {"=": (">=", "<="), "<": ("<",), "<=": ("<=",), ">": (">",), ">=": (">=",)}
#: Arguments of built-ins that are regular expressions, and divisors, by the built-in and the argument's number.
_PATTERNS: Final = {("matches", 1), ("tokenize", 2)}
_DIVISORS: Final = {("divide", 2), ("integerDivide", 2), ("mod", 2)}
_DOUBLE: Final = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?INF|NaN")
_LEXICAL: Final = {
    XSD + "boolean": re.compile(r"true|false|0|1"),
    XSD + "decimal": re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)"),
    XSD + "integer": re.compile(r"[+-]?[0-9]+"),
    XSD + "double": _DOUBLE,
    XSD + "float": _DOUBLE,
}


@dataclass(frozen=True, slots=True)
class RuleProblem:
    """Something wrong with a rule.

    Attributes:
        message: what is wrong.
        place: where in the rule's file (rules as text), or in the rule's own text (rules of ontologies).
        remedy: how to correct it.
        is_fatal: whether the rule cannot work; otherwise it is only suspicious.
    """

    message: str
    place: Place | None
    remedy: str | None = None
    is_fatal: bool = True


def check_rule(rule: Rule, vocabulary: Vocabulary) -> list[RuleProblem]:
    """Find all problems of one rule, in the order of its text."""
    problems = list(_check_variables(rule))
    for number, atom in enumerate(rule.atoms):
        problems += _check_atom(atom, vocabulary, is_head=number >= len(rule.body))
    problems += _check_comparisons(rule, vocabulary)
    if not rule.head:
        problems.append(RuleProblem("the rule concludes nothing", None, "write at least one atom after ->"))
    return sorted(problems, key=lambda problem: (problem.place or Place(0, 0), problem.message))


def fatal_problems(rule: Rule, vocabulary: Vocabulary) -> list[RuleProblem]:
    """Find the problems with which a rule cannot work, in the order of its text."""
    return [problem for problem in check_rule(rule, vocabulary) if problem.is_fatal]


def first_error(rule: Rule, vocabulary: Vocabulary) -> RuleError | None:
    """The first fatal problem of a rule of a text file, as an error."""
    for problem in fatal_problems(rule, vocabulary):
        place = str(problem.place) if problem.place else rule.place
        return RuleError(f"rule {rule.name}: {problem.message}", file=rule.file, place=place, remedy=problem.remedy)
    return None


def check_property_use(triples: Iterable[Triple], rules: Iterable[Rule]) -> None:
    """Check that rules use each property as it is declared.

    Otherwise Pellet drops every rule with that property, and names the wrong ones.

    Raises:
        KnowledgeError: with the file and the rule.
    """
    kinds = {OWL + "ObjectProperty": False, OWL + "DatatypeProperty": True}
    declared = {s: kinds[o] for s, p, o in triples if p == RDF_TYPE and isinstance(o, str) and o in kinds}
    words = {True: "data", False: "object"}
    for rule in rules:
        for name, is_data in sorted(rule.properties):
            if declared.get(name, is_data) != is_data:
                used = f"declared as {words[not is_data]} property, but used as {words[is_data]} property"
                where, remedy = f"rule {rule.name}", f"the rule is: {rule.text}"
                raise KnowledgeError(f"{local_name(name)} is {used}", file=rule.file, place=where, remedy=remedy)


def _check_atom(atom: Atom, vocabulary: Vocabulary, *, is_head: bool) -> Iterator[RuleProblem]:
    name = local_name(atom.predicate)
    if atom.kind == "builtin":
        yield from _check_builtin(atom, name, is_head=is_head)
        return
    if atom.kind == "" or not atom.predicate:
        yield RuleProblem("an atom without a kind that SWRL knows, or without a name", atom.place())
        return
    if atom.kind == "range":
        if not atom.predicate.startswith(XSD) and "datatype" not in vocabulary.kinds.get(atom.predicate, ()):
            yield RuleProblem(f"datatype {name} is not defined", atom.place())
    elif atom.kind in _DECLARED_AS and atom.predicate != EXPRESSION:
        wrong = _check_predicate(atom, name, vocabulary)
        if wrong is not None:
            yield wrong
            return
    wanted = _ARGUMENTS[atom.kind]
    if len(atom.arguments) != wanted:
        words = "one argument" if wanted == 1 else "two arguments"
        yield RuleProblem(f"{name} takes {words}, not {len(atom.arguments)}", atom.place())
        return
    for number, term in enumerate(atom.arguments):
        yield from _check_argument(atom, number, term, vocabulary, is_head=is_head)


def _check_predicate(atom: Atom, name: str, vocabulary: Vocabulary) -> RuleProblem | None:
    """Check that a class or property is declared, and used as declared."""
    declared = vocabulary.kinds.get(atom.predicate, frozenset())
    wanted = _DECLARED_AS[atom.kind]
    if wanted in declared:
        return None
    if "class" in declared:
        return RuleProblem(f"{name} is a class, but is used as a property", atom.place(), f"write {name}(?x)")
    found = next((kind for kind in ("object property", "data property") if kind in declared), None)
    if found is not None:
        remedy = {
            "class": f"write {name}(?x, ?y)",
            "data": "its second argument is an individual, not a value",
            "object": "its second argument is a value, not an individual",
        }[atom.kind]
        return RuleProblem(f"{name} is {_a(found)}, but is used as {_a(wanted)}", atom.place(), remedy)
    if declared:
        return RuleProblem(f"{name} is {_a(min(declared))}, but is used as {_a(wanted)}", atom.place())
    kinds = ("class",) if atom.kind == "class" else ("object property", "data property")
    remedy = vocabulary.guess(atom.predicate, kinds) or f"declare it as {wanted} in the ontology"
    return RuleProblem(f"{wanted} {name} is not defined", atom.place(), remedy)


def _a(kind: str) -> str:
    return f"{'an' if kind[0] in 'aio' else 'a'} {kind}"


def _check_argument(
    atom: Atom, number: int, term: Term, vocabulary: Vocabulary, *, is_head: bool
) -> Iterator[RuleProblem]:
    """Check that an argument is an individual or a value, as required, and possible for that property."""
    name, place, takes_value = local_name(atom.predicate), atom.place(number), atom.takes_value(number)
    if isinstance(term, Lit) and not takes_value:
        yield RuleProblem(f"{name}: {literal_text(term)} is a value, but an individual is needed", place)
    elif isinstance(term, Named):
        thing = local_name(term.iri)
        if takes_value:
            problem = f"{name}: {thing} is an individual where a value is needed"
            yield RuleProblem(problem, place, f'a text needs quotes: "{thing}"')
        elif "individual" not in vocabulary.kinds.get(term.iri, ()):
            remedy = vocabulary.guess(term.iri, ("individual",))
            yield RuleProblem(f"individual {thing} is not defined", place, remedy)
    elif isinstance(term, Lit) and atom.kind == "data":
        lexical = _LEXICAL.get(term.datatype)
        ranges = vocabulary.ranges.get(atom.predicate, frozenset({term.datatype}))
        whole = term.datatype == XSD + "integer" and XSD + "decimal" in ranges  # matches no decimal, but is one
        if lexical is not None and not lexical.fullmatch(term.text.strip()):
            yield RuleProblem(f"{term.text!r} is not {_a(local_name(term.datatype))}", place)
        elif term.datatype not in ranges and not (whole and is_head):
            wanted = " or ".join(sorted(map(local_name, ranges)))
            consequence = "contradicts whatever it is concluded of" if is_head else "never matches"
            problem = f"{literal_text(term)} is not {_a(wanted)}, the range of {name}: it {consequence}"
            yield RuleProblem(problem, place, f"write {term.text}.0" if whole else f"a value of {wanted}")
        elif term.text not in (values := vocabulary.enumerations.get(atom.predicate, frozenset({term.text}))):
            consequence = "contradicts whatever it is concluded of" if is_head else "never matches"
            problem = f"{literal_text(term)} is not among the values of {name}: it {consequence}"
            yield RuleProblem(problem, place, nearest(term.text, values) or f"one of {', '.join(sorted(values))}")


def _check_comparisons(rule: Rule, vocabulary: Vocabulary) -> Iterator[RuleProblem]:
    """Find comparisons that no value satisfies, alone or together, so that the rule never fires."""
    holders = dict(rule.read_values())
    least: dict[str, tuple[Decimal, bool, str]] = {}  # number, whether it is excluded, how it is written
    most: dict[str, tuple[Decimal, bool, str]] = {}
    for atom in rule.body:
        sign = COMPARISONS.get(atom.predicate, "")
        if not sign or len(atom.arguments) != 2:
            continue
        one, other = atom.arguments
        if isinstance(one, Lit) and isinstance(other, Variable):
            one, other, sign = other, one, mirrored(sign)
        if not (isinstance(one, Variable) and isinstance(other, Lit)):
            continue
        values = vocabulary.enumerations.get(holders.get(one.name, ""))
        if values is not None and sign in ("=", "!=") and other.text not in values:
            where, consequence = local_name(holders[one.name]), "never" if sign == "=" else "always"
            problem = f"{literal_text(other)} is not among the values of {where}: the comparison {consequence} holds"
            remedy = nearest(other.text, values) or f"one of {', '.join(sorted(values))}"
            yield RuleProblem(problem, atom.place(), remedy, is_fatal=False)
        if sign not in _BOUNDS:
            continue
        ranges = vocabulary.ranges.get(holders.get(one.name, ""), frozenset())
        if ranges and ranges <= NUMERIC and other.datatype not in NUMERIC:
            name = local_name(COMPARISON_OF[sign])
            problem = f"{name} compares ?{one.name}, a number, with the text {literal_text(other)}: it never holds"
            yield RuleProblem(problem, atom.place(), f"write {other.text} without quotes", is_fatal=False)
        elif other.datatype in NUMERIC and _LEXICAL[XSD + "decimal"].fullmatch(other.text.strip()):
            number = Decimal(other.text.strip())
            for side in _BOUNDS[sign]:
                bounds, is_tighter = (least, gt) if side[0] == ">" else (most, lt)
                bound = number, "=" not in side, f"{'=' if sign == '=' else side} {other.text}"
                known = bounds.get(one.name)
                if known is None or is_tighter(number, known[0]) or (number == known[0] and bound[1]):
                    bounds[one.name] = bound
            if one.name in least and one.name in most:
                low, high = least[one.name], most[one.name]
                if low[0] > high[0] or (low[0] == high[0] and (low[1] or high[1])):
                    problem = f"no value of ?{one.name} is {low[2]} and {high[2]}: the rule never fires"
                    yield RuleProblem(problem, atom.place(), "reverse one of the comparisons", is_fatal=False)


def _check_builtin(atom: Atom, name: str, *, is_head: bool) -> Iterator[RuleProblem]:
    counts = BUILTINS.get(atom.predicate)
    if counts is None:
        known = f"known: {', '.join(sorted(map(local_name, BUILTINS)))}"
        suggestion = nearest(name, map(local_name, BUILTINS)) or known
        yield RuleProblem(f"there is no builtin {name} in Pellet", atom.place(), suggestion)
        return
    if is_head:
        yield RuleProblem(f"builtin {name} occurs in the head", atom.place(), "Pellet takes builtins in bodies only")
    least, most = counts
    if not least <= len(atom.arguments) <= most:
        wanted = str(least) if least == most else f"{least} or more" if most == 99 else f"{least} to {most}"
        has_comma = [isinstance(term, Lit) and term.datatype == XSD + "integer" for term in atom.arguments[-2:]]
        remedy = "write decimals with a point" if has_comma == [True, True] else None
        yield RuleProblem(f"{name} takes {wanted} arguments, not {len(atom.arguments)}", atom.place(), remedy)
    for number, term in enumerate(atom.arguments):
        if isinstance(term, Named):
            problem = f"{name}: {local_name(term.iri)} is an individual where a value is needed"
            yield RuleProblem(problem, atom.place(number))
        elif isinstance(term, Lit) and (name, number) in _PATTERNS and _is_broken(term.text):
            problem = f"{name}: {literal_text(term)} is not a regular expression, so it never holds"
            yield RuleProblem(problem, atom.place(number), is_fatal=False)
        elif isinstance(term, Lit) and (name, number) in _DIVISORS and re.fullmatch(r"[+-]?[0.]+", term.text):
            problem = f"{name} by {term.text} has no result, so it never holds"
            yield RuleProblem(problem, atom.place(number), is_fatal=False)


def _is_broken(pattern: str) -> bool:
    """Whether a regular expression is wrong in any language; Pellet uses Java's."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about what Java has and Python may have one day
            re.compile(pattern)
    except re.error as error:
        if error.msg == "nothing to repeat":  # Java repeats anchors, such as ^
            return pattern[: error.pos][-1:] in ("", "(", "|")
        return error.msg.startswith(("unterminated character set", "missing )", "unbalanced"))
    return False


def _uses(atoms: Iterable[Atom]) -> Iterator[tuple[Atom, int, str]]:
    """(atom, number of the argument, name) of each variable."""
    for atom in atoms:
        for number, term in enumerate(atom.arguments):
            if isinstance(term, Variable):
                yield atom, number, term.name


def _check_variables(rule: Rule) -> Iterator[RuleProblem]:
    """Find unbound variables, and variables that stand for both an individual and a value."""
    individuals: dict[str, Place] = {}
    values: dict[str, Place] = {}
    for atom, number, name in _uses(rule.atoms):
        (values if atom.takes_value(number) else individuals).setdefault(name, atom.place(number) or Place(0, 0))
    for name in sorted(individuals.keys() & values.keys()):
        place = max(individuals[name], values[name])
        yield RuleProblem(f"?{name} stands for an individual and for a value", place)
    uses = [(name, atom.place(number)) for atom, number, name in _uses(rule.atoms)]
    counts = Counter(name for name, _ in uses)
    for name, at in uses:
        others = [each for each in counts if each != name and each.casefold() == name.casefold()]
        if counts[name] == 1 and others:
            problem = f"?{name} occurs only here, and is another variable than ?{others[0]}"
            yield RuleProblem(problem, at, f"did you mean ?{others[0]}?", is_fatal=False)
    bound = {
        name for atom in rule.body if atom.kind in ("class", "object", "data", "same") for name in atom.variables()
    }
    builtins = [atom for atom in rule.body if atom.kind == "builtin" and atom.arguments]
    while more := _computed(builtins, bound) - bound:
        bound |= more
    known = bound | {name for atom in rule.atoms for name in atom.variables()}
    for atom, number, name in _uses(builtins):
        if name not in bound:
            reason = "" if number or atom.predicate in TESTERS else ", nor can be computed"
            problem = f"?{name} has no value in {local_name(atom.predicate)}: no other atom binds it{reason}"
            yield RuleProblem(problem, atom.place(number), nearest(name, known - {name}))
    for atom, number, name in _uses(rule.head):
        if name not in bound:
            problem = f"?{name} occurs in the head, but the body does not bind it"
            yield RuleProblem(problem, atom.place(number), nearest(name, bound))


def _computed(builtins: Iterable[Atom], bound: set[str]) -> set[str]:
    """Variables that builtins compute: the first argument, once all others have values."""
    return {
        first.name
        for first, *others in (atom.arguments for atom in builtins if atom.computes)
        if isinstance(first, Variable) and all(not isinstance(term, Variable) or term.name in bound for term in others)
    }


def recursing_rules(rules: Iterable[Rule]) -> list[Rule]:
    """Find rules whose computed values feed back, through any rules, into their own computation."""
    enabled = [rule for rule in rules if rule.enabled]
    steps = {(atom.predicate, head.predicate) for rule in enabled for atom in rule.body for head in rule.head}
    return [
        rule
        for rule in enabled
        if not reached(_computed_properties(rule), steps).isdisjoint(atom.predicate for atom in rule.body)
    ]


def _computed_properties(rule: Rule) -> set[str]:
    """Properties of which a rule concludes a value that it computes."""
    bound = {name for atom in rule.body if atom.kind != "builtin" for name in atom.variables()}
    computed = {name for atom in rule.body if atom.kind == "builtin" for name in atom.variables()} - bound
    return {atom.predicate for atom in rule.head if atom.kind == "data" and computed.intersection(atom.variables())}
