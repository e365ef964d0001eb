"""Checks of rules: all that Pellet drops or ignores silently, and what no reasoner could use.

Which mistakes Pellet is silent about was found by giving it each of them (owlready2 0.51's Pellet).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from suave_des.errors import KnowledgeError
from suave_des.knowledge.rdf import Lit, Triple
from suave_des.knowledge.rules.names import BUILTINS, TESTERS, Vocabulary
from suave_des.knowledge.rules.syntax import EXPRESSION, Atom, Named, Place, Rule, RuleError, Variable
from suave_des.knowledge.rules.writer import literal_text
from suave_des.knowledge.vocabulary import OWL, RDF_TYPE, XSD, local_name, nearest

_PROPERTY_OF: Final = {"object": "object property", "data": "data property"}
_ARGUMENTS: Final = {"class": 1, "range": 1, "object": 2, "data": 2, "same": 2, "different": 2}
_WORDS: Final = {1: "one argument", 2: "two arguments"}
_LEXICAL: Final = {
    XSD + "boolean": re.compile(r"true|false|0|1"),
    XSD + "decimal": re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)"),
    XSD + "integer": re.compile(r"[+-]?[0-9]+"),
    XSD + "double": re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?INF|NaN"),
    XSD + "float": re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?INF|NaN"),
}


@dataclass(frozen=True, slots=True)
class RuleProblem:
    """Something wrong with a rule.

    Attributes:
        message: what is wrong.
        place: where in the rule's file (rules as text), or in the rule's own text (rules of ontologies).
        remedy: what would be right.
        is_fatal: whether the rule cannot do what it says; otherwise it is suspicious only.
    """

    message: str
    place: Place | None
    remedy: str | None = None
    is_fatal: bool = True


def check_rule(rule: Rule, vocabulary: Vocabulary) -> list[RuleProblem]:
    """All that is wrong with one rule, in the order of its text."""
    problems: list[RuleProblem] = []
    for number, atom in enumerate(rule.atoms):
        problems += _check_atom(atom, vocabulary, is_head=number >= len(rule.body))
    problems += _check_variables(rule)
    if not rule.head:
        problems.append(RuleProblem("the rule concludes nothing", None, "write at least one atom after ->"))
    return sorted(problems, key=lambda problem: (problem.place or Place(0, 0), problem.message))


def first_error(rule: Rule, problems: Iterable[RuleProblem]) -> RuleError | None:
    """The first fatal problem of a rule of a text file, as an error."""
    for problem in problems:
        if problem.is_fatal:
            place = str(problem.place) if problem.place else rule.place
            return RuleError(f"rule {rule.name}: {problem.message}", file=rule.file, place=place, remedy=problem.remedy)
    return None


def check_property_use(triples: Iterable[Triple], rules: Iterable[Rule]) -> None:
    """Check that rules use each property as it is declared.

    Where one does not, Pellet leaves out every rule with that property, and names the wrong ones.

    Raises:
        KnowledgeError: with the file and the rule.
    """
    kinds = {OWL + "ObjectProperty": False, OWL + "DatatypeProperty": True}
    declared = {s: kinds[o] for s, p, o in triples if p == RDF_TYPE and isinstance(o, str) and o in kinds}
    words = {True: "data", False: "object"}
    for rule in rules:
        for name, is_data in sorted(rule.properties):
            if declared.get(name, is_data) != is_data:
                raise KnowledgeError(
                    f"{local_name(name)} is declared as {words[not is_data]} property, but used as {words[is_data]} "
                    "property",
                    file=rule.file,
                    place=f"rule {rule.name}",
                    remedy=f"the rule is: {rule.text}",
                )


def _check_atom(atom: Atom, vocabulary: Vocabulary, *, is_head: bool) -> Iterator[RuleProblem]:
    name = local_name(atom.predicate)
    if atom.kind == "builtin":
        yield from _check_builtin(atom, name, is_head=is_head)
        return
    if atom.kind == "" or not atom.predicate:
        yield RuleProblem("an atom without a kind that SWRL knows, or without a name", atom.place())
        return
    if atom.kind == "different":
        yield RuleProblem(
            "differentFrom makes Pellet lose what other rules infer",
            atom.place(),
            "distinguish individuals by a property",
        )
    if atom.kind == "range":
        if not atom.predicate.startswith(XSD) and "datatype" not in vocabulary.kinds.get(atom.predicate, ()):
            yield RuleProblem(f"datatype {name} is not defined", atom.place())
    elif atom.kind in ("class", "object", "data") and atom.predicate != EXPRESSION:
        wrong = _check_predicate(atom, name, vocabulary)
        if wrong is not None:
            yield wrong
            return
    wanted = _ARGUMENTS[atom.kind]
    if len(atom.arguments) != wanted:
        yield RuleProblem(f"{name} takes {_WORDS[wanted]}, not {len(atom.arguments)}", atom.place())
        return
    yield from _check_arguments(atom, name, vocabulary, is_head=is_head)


def _check_predicate(atom: Atom, name: str, vocabulary: Vocabulary) -> RuleProblem | None:
    """Whether a class or property is declared, and as what it is used as."""
    declared = vocabulary.kinds.get(atom.predicate, frozenset())
    wanted = "class" if atom.kind == "class" else _PROPERTY_OF[atom.kind]
    if wanted in declared:
        return None
    if "class" in declared:
        return RuleProblem(f"{name} is a class, but is used as a property", atom.place(), f"write {name}(?x)")
    for other in ("object property", "data property"):
        if other in declared:
            used = "a class" if atom.kind == "class" else f"{'an' if atom.kind == 'object' else 'a'} {wanted}"
            remedy = f"write {name}(?x, ?y)" if atom.kind == "class" else None
            if atom.kind == "data":
                remedy = "its second argument is an individual, not a value"
            elif atom.kind == "object":
                remedy = "its second argument is a value, not an individual"
            article = "an" if other.startswith("o") else "a"
            return RuleProblem(f"{name} is {article} {other}, but is used as {used}", atom.place(), remedy)
    if declared:
        return RuleProblem(f"{name} is an {sorted(declared)[0]}, but is used as a {wanted}", atom.place())
    kinds = ("class",) if atom.kind == "class" else tuple(_PROPERTY_OF.values())
    remedy = vocabulary.guess(atom.predicate, kinds) or f"declare it as {wanted} in the ontology"
    return RuleProblem(f"{wanted} {name} is not defined", atom.place(), remedy)


def _check_arguments(atom: Atom, name: str, vocabulary: Vocabulary, *, is_head: bool) -> Iterator[RuleProblem]:
    for number, term in enumerate(atom.arguments):
        takes_value = atom.kind == "range" or (atom.kind == "data" and number == 1)
        place = atom.place(number)
        if isinstance(term, Lit) and not takes_value:
            yield RuleProblem(f"{name}: {literal_text(term)} is a value where an individual is needed", place)
        elif isinstance(term, Named):
            if takes_value:
                yield RuleProblem(
                    f"{name}: {local_name(term.iri)} is an individual where a value is needed",
                    place,
                    f'a text stands in quotes: "{local_name(term.iri)}"',
                )
            elif "individual" not in vocabulary.kinds.get(term.iri, ()):
                remedy = vocabulary.guess(term.iri, ("individual",))
                yield RuleProblem(f"individual {local_name(term.iri)} is not defined", place, remedy)
        elif isinstance(term, Lit) and atom.kind == "data":
            yield from _check_value(term, atom.predicate, place, vocabulary, is_head=is_head)


def _check_value(
    value: Lit, property_iri: str, place: Place | None, vocabulary: Vocabulary, *, is_head: bool
) -> Iterator[RuleProblem]:
    """A literal that the property cannot have: it contradicts in a head, and matches nothing in a body."""
    name = local_name(property_iri)
    lexical = _LEXICAL.get(value.datatype)
    if lexical is not None and not lexical.fullmatch(value.text.strip()):
        yield RuleProblem(f"{value.text!r} is no {local_name(value.datatype)}", place)
        return
    ranges = vocabulary.ranges.get(property_iri)
    if ranges is None or value.datatype in ranges:
        return
    wanted = " or ".join(sorted(map(local_name, ranges)))
    remedy = f"write {value.text}.0" if value.datatype == XSD + "integer" and XSD + "decimal" in ranges else None
    if value.datatype == XSD + "integer" and XSD + "decimal" in ranges and is_head:
        return
    consequence = "contradicts whatever it is concluded of" if is_head else "never matches"
    yield RuleProblem(
        f"{literal_text(value)} is no {wanted}, which {name} has: it {consequence}",
        place,
        remedy or f"a value of {wanted}",
    )


def _check_builtin(atom: Atom, name: str, *, is_head: bool) -> Iterator[RuleProblem]:
    counts = BUILTINS.get(atom.predicate)
    if counts is None:
        known = map(local_name, BUILTINS)
        yield RuleProblem(f"there is no builtin {name} in Pellet", atom.place(), nearest(name, known))
        return
    if is_head:
        yield RuleProblem(f"builtin {name} stands in the head", atom.place(), "Pellet takes builtins in bodies only")
    least, most = counts
    if not least <= len(atom.arguments) <= most:
        wanted = str(least) if least == most else f"{least} or more" if most == 99 else f"{least} to {most}"
        yield RuleProblem(f"{name} takes {wanted} arguments, not {len(atom.arguments)}", atom.place())
    for number, term in enumerate(atom.arguments):
        if isinstance(term, Named):
            yield RuleProblem(
                f"{name}: {local_name(term.iri)} is an individual where a value is needed", atom.place(number)
            )


def _check_variables(rule: Rule) -> Iterator[RuleProblem]:
    """Variables that nothing binds, and variables that stand for an individual and for a value at once."""
    individuals: dict[str, Place | None] = {}
    values: dict[str, Place | None] = {}
    for atom in rule.atoms:
        for number, term in enumerate(atom.arguments):
            if isinstance(term, Variable):
                is_value = atom.kind in ("builtin", "range") or (atom.kind == "data" and number == 1)
                (values if is_value else individuals).setdefault(term.name, atom.place(number))
    for name in sorted(individuals.keys() & values.keys()):
        place = max(individuals[name] or Place(0, 0), values[name] or Place(0, 0))
        yield RuleProblem(f"?{name} stands for an individual and for a value", place)
    bound = {
        name for atom in rule.body if atom.kind in ("class", "object", "data", "same") for name in atom.variables()
    }
    builtins = [atom for atom in rule.body if atom.kind == "builtin" and atom.arguments]
    bound |= _computed(builtins, bound)
    known = bound | {name for atom in rule.atoms for name in atom.variables()}
    for atom, number, name in _unbound(builtins, bound):
        reason = "" if number or atom.predicate in TESTERS else ", nor can be computed"
        yield RuleProblem(
            f"?{name} has no value in {local_name(atom.predicate)}: no other atom binds it{reason}",
            atom.place(number),
            nearest(name, known - {name}),
        )
    for atom in rule.head:
        for number, term in enumerate(atom.arguments):
            if isinstance(term, Variable) and term.name not in bound:
                yield RuleProblem(
                    f"?{term.name} stands in the head, but the body does not bind it",
                    atom.place(number),
                    nearest(term.name, bound),
                )


def _computed(builtins: Sequence[Atom], bound: set[str]) -> set[str]:
    """Variables that builtins compute: the first argument, once all others have values."""
    found: set[str] = set()
    while True:
        more = {
            atom.arguments[0].name
            for atom in builtins
            if atom.predicate not in TESTERS
            and isinstance(atom.arguments[0], Variable)
            and all(not isinstance(term, Variable) or term.name in bound | found for term in atom.arguments[1:])
        }
        if more <= bound | found:
            return found
        found |= more


def _unbound(builtins: Sequence[Atom], bound: set[str]) -> Iterator[tuple[Atom, int, str]]:
    for atom in builtins:
        for number, term in enumerate(atom.arguments):
            if isinstance(term, Variable) and term.name not in bound:
                yield atom, number, term.name
