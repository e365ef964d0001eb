"""Describe why an atom of a rule does not hold: the value found, the value needed, and a remedy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from suave_des.errors import nearest
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import C_STATUS, HAS_QA_VALUE, NUMERIC, OWL, TOMASYS, Lit, local_name, value_of
from suave_des.knowledge.rules.syntax import COMPARISONS, Atom, Variable
from suave_des.knowledge.rules.writer import literal_text
from suave_des.workbench.reasons.matching import FACT_KINDS, Binding, Facts, bound

_WORDS: Final = {
    "<": "less than",
    "<=": "at most",
    ">": "greater than",
    ">=": "at least",
    "=": "equal to",
    "!=": "different from",
}
#: What a state asserts, and how to give it.
_GIVEN_BY_STATES: Final[Mapping[str, str]] = {
    TOMASYS + "FunctionGrounding": "ground a function: --at FUNCTION=DESIGN",
    TOMASYS + "typeFD": "ground a function: --at FUNCTION=DESIGN",
    TOMASYS + "solvesO": "ground a function: --at FUNCTION=DESIGN",
    C_STATUS: "report a component: --at COMPONENT=FALSE",
    HAS_QA_VALUE: "measure what the grounded design expects: --at ATTRIBUTE=NUMBER",
    TOMASYS + "Objective": "ask for a function: --objective FUNCTION",
}
#: How OWL says what is not, or what all values are: neither follows from facts that are missing.
_CLOSED_WORLD: Final = ("complementOf", "allValuesFrom", "maxCardinality", "maxQualifiedCardinality")


def describe_failure(base: Ontology, atom: Atom, binding: Binding, facts: Facts) -> str:
    """Describe why an atom does not hold.

    Args:
        atom: of the body of a rule.
        binding: what variables stand for.
        facts: all that follows.
    """
    if atom.kind == "class":
        return _class(base, atom, binding, facts)
    if atom.kind in FACT_KINDS:
        return _property(base, atom, binding, facts)
    if atom.predicate in COMPARISONS and len(atom.arguments) == 2:
        return _comparison(base, atom, binding)
    if atom.kind == "different":
        return "OWL does not assume that different names mean different individuals: assert it"
    if atom.kind == "same":
        return "these individuals are not known to be the same"
    values = [f"?{name} = {_show(base, binding[name])}" for name in atom.variables() if name in binding]
    return f"it is false for {', '.join(values)}" if values else "it is false for these values"


def _comparison(base: Ontology, atom: Atom, binding: Binding) -> str:
    sides = [bound(term, binding) for term in atom.arguments]
    texts = [
        _show(base, value) + (f" (?{term.name})" if isinstance(term, Variable) else "")
        for term, value in zip(atom.arguments, sides, strict=True)
    ]
    words = _WORDS[COMPARISONS[atom.predicate]]
    kinds = [value.datatype for value in sides if isinstance(value, Lit)]
    numbers = [kind in NUMERIC for kind in kinds]
    if len(kinds) == 2 and numbers[0] != numbers[1]:
        text = texts[numbers.index(False)]
        return (
            f"{text} is text, and never compares with the number {texts[numbers.index(True)]}; write it without quotes"
        )
    return f"found {texts[0]}, needed {words} {texts[1]}"


def _property(base: Ontology, atom: Atom, binding: Binding, facts: Facts) -> str:
    name = local_name(atom.predicate)
    subject, wanted = (bound(term, binding) for term in (atom.arguments[0], atom.arguments[-1]))
    who = base.names.short(subject) if isinstance(subject, str) else None
    values = facts.values(subject if isinstance(subject, str) else None, atom.predicate)
    if not values:
        return f"{f'{who} has no' if who else 'nothing has a'} {name}{_help(base, atom)}"
    if wanted is not None:
        of = f" of {who}" if who else ""
        return f"found {name} {_list(base, values)}{of}, needed {_show(base, wanted)}{_unequal(values, wanted)}"
    if who:
        return f"{who} has {name} {_list(base, values)}, but not as the other atoms need it"
    return f"no {name} connects what the other atoms need"


def _class(base: Ontology, atom: Atom, binding: Binding, facts: Facts) -> str:
    name = local_name(atom.predicate)
    closed = next(_closed_world(base, atom.predicate), None)
    if closed is not None:
        why = f"; {name} is defined by {closed}, which never follows from missing facts (open world)"
    else:
        why = _help(base, atom)
    subject = bound(atom.arguments[0], binding)
    if isinstance(subject, str):
        return f"{base.names.short(subject)} is not known to be a {name}{why}"
    return f"there is no {name}{why}"


def _unequal(values: list[str | Lit], wanted: str | Lit) -> str:
    """Why values that look alike are not equal."""
    if not isinstance(wanted, Lit):
        return ""
    for value in values:
        if not isinstance(value, Lit):
            continue
        if value.datatype != wanted.datatype:
            kinds = f"{local_name(value.datatype)} and {local_name(wanted.datatype)}"
            return f"; {kinds} never match, even where they look alike: write {literal_text(value)}"
        if value.text.strip().lower() == wanted.text.strip().lower():
            return "; they differ in case or spaces"
    texts = [value.text for value in values if isinstance(value, Lit)]
    near = nearest(wanted.text, texts)
    return f"; {near}" if near else ""


def _help(base: Ontology, atom: Atom) -> str:
    """Return a remedy if nothing is known of a property or class."""
    if _only_said_to_exist(base, atom.predicate):
        name = local_name(atom.predicate)
        return f"; an axiom says that there is some {name}, but not which, and rules see known individuals only"
    given = _GIVEN_BY_STATES.get(atom.predicate)
    return f"; {given}" if given else ""


def _only_said_to_exist(base: Ontology, iri: str) -> bool:
    """Whether an axiom says that something has a value of a property, but not which."""
    lines = [line.split(" ", 2) for line in base.content.structure]
    restricted = {subject for subject, _, value in lines if value.startswith(f"<{iri}>")}
    return any(subject in restricted and predicate == f"<{OWL}someValuesFrom>" for subject, predicate, _ in lines)


def _closed_world(base: Ontology, iri: str) -> Iterator[str]:
    """Constructors in the definition of a class that need a closed world."""
    children: dict[str, list[tuple[str, str]]] = {}
    for line in base.content.structure:
        subject, predicate, value = line.rstrip(" .\n").split(" ", 2)
        children.setdefault(subject, []).append((predicate.strip("<>"), value))
    waiting, seen = [f"<{iri}>"], {f"<{iri}>"}
    while waiting:
        for predicate, value in children.get(waiting.pop(), ()):
            if predicate.removeprefix(OWL) in _CLOSED_WORLD:
                yield local_name(predicate)
            if value.startswith("_:") and value not in seen:
                seen.add(value)
                waiting.append(value)


def _show(base: Ontology, value: str | Lit | None) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, Lit):
        is_plain_number = value.datatype in NUMERIC and str(value_of(value, base.names)) == value.text
        return value.text if is_plain_number else literal_text(value)
    return base.names.short(value)


def _list(base: Ontology, values: list[str | Lit], most: int = 3) -> str:
    texts = sorted({_show(base, value) for value in values})
    return ", ".join(texts[:most]) + (f" and {len(texts) - most} more" if len(texts) > most else "")
