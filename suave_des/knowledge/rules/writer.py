"""Write SWRL rules as text: for messages on one line, and for files so that they read back the same."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final

from suave_des.knowledge.rdf import ESCAPES, SWRLB, XSD, Lit, local_name, namespace
from suave_des.knowledge.rules.parser import PREFIXES
from suave_des.knowledge.rules.syntax import Atom, Named, Place, Term, Variable

_WORD: Final = re.compile(r"[^\W\d](?:[\w.-]*\w)?")
#: Literals without quotes, by the datatype that the parser gives them.
_BARE: Final = {
    XSD + "boolean": re.compile(r"true|false"),
    XSD + "integer": re.compile(r"[+-]?[0-9]+"),
    XSD + "decimal": re.compile(r"[+-]?(?:[0-9]+\.[0-9]*|\.[0-9]+)"),
    XSD + "double": re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE][+-]?[0-9]{1,4}"),
}
#: Gives the text of an IRI.
Naming = Callable[[str], str]


def full_name(iri: str) -> str:
    """Write an IRI with a known prefix, or in angle brackets: that reads back with any vocabulary."""
    for prefix, start in PREFIXES.items():
        if iri.startswith(start) and _WORD.fullmatch(iri[len(start) :]):
            return f"{prefix}:{iri[len(start) :]}"
    return f"<{iri}>"


def naming(shared: Callable[[str], bool]) -> Naming:
    """Write bare names, but full ones for IRIs whose last part alone is ambiguous or unknown.

    Args:
        shared: whether the bare name of an IRI means something else, or nothing.
    """

    def name(iri: str) -> str:
        bare = local_name(iri)
        if ":" not in iri or (namespace(iri) == SWRLB and not shared(iri)):
            return bare
        return bare if _WORD.fullmatch(bare) and bare not in ("true", "false") and not shared(iri) else full_name(iri)

    return name


def write_rule(name: str, body: Sequence[Atom], head: Sequence[Atom], named: Naming, *, enabled: bool = True) -> str:
    """Write a rule for a rules file, one atom a line where one line would be long."""
    word = name if _WORD.fullmatch(name) and name not in ("prefix", "disabled") else _quoted(name)
    start = f"{'' if enabled else 'disabled '}{word}:"
    sides = [[write_atom(atom, named) for atom in side] for side in (body, head)]
    line = f"{start} {' ^ '.join(sides[0])}{' ' if body else ''}-> {' ^ '.join(sides[1])}"
    if len(line) <= 110:
        return line + "\n"
    return f"{start}\n    " + "\n    ^ ".join(sides[0]) + "\n    -> " + "\n    ^ ".join(sides[1]) + "\n"


def line_of_rule(body: Sequence[Atom], head: Sequence[Atom]) -> tuple[str, tuple[Atom, ...], tuple[Atom, ...]]:
    """Write a rule on one line, body -> head; also return body and head with the places of their atoms in it."""
    text = ""
    placed: list[list[Atom]] = [[], []]
    for side, atoms in enumerate((body, head)):
        for number, atom in enumerate(atoms):
            text += " ^ " if number else (" -> " if side and body else "-> " if side else "")
            places = [Place(1, len(text) + 1)]
            text += f"{_predicate(atom, local_name)}("
            for count, argument in enumerate(atom.arguments):
                text += ", " if count else ""
                places.append(Place(1, len(text) + 1))
                text += _term(argument, local_name)
            text += ")"
            placed[side].append(replace(atom, places=tuple(places)))
    return text, tuple(placed[0]), tuple(placed[1])


def write_atom(atom: Atom, named: Naming = local_name) -> str:
    """Write one atom."""
    return f"{_predicate(atom, named)}({', '.join(_term(term, named) for term in atom.arguments)})"


def _predicate(atom: Atom, named: Naming) -> str:
    return named(atom.predicate) if atom.predicate else "nothing"


def _term(term: Term, named: Naming) -> str:
    if isinstance(term, Variable):
        return f"?{term.name}"
    if isinstance(term, Named):
        return named(term.iri)
    bare = _BARE.get(term.datatype)
    if bare is not None and bare.fullmatch(term.text):
        return term.text
    if term.datatype.startswith("@"):
        return _quoted(term.text) + term.datatype
    if term.datatype == XSD + "string":
        return _quoted(term.text)
    return f"{_quoted(term.text)}^^{full_name(term.datatype)}"


def _quoted(text: str) -> str:
    return f'"{text.translate(ESCAPES)}"'


def distinct_variables(atoms: Iterable[Atom]) -> dict[str, str]:
    """Choose a different short name for each variable, which is named by its IRI so far."""
    chosen: dict[str, str] = {}
    taken: set[str] = set()
    for variable in dict.fromkeys(name for atom in atoms for name in atom.variables()):
        wish = re.sub(r"[^\w-]", "_", local_name(variable)).lstrip("-") or "v"
        name, number = wish, 2
        while name in taken:
            name, number = f"{wish}_{number}", number + 1
        chosen[variable] = name
        taken.add(name)
    return chosen


def literal_text(value: Lit) -> str:
    """Write a literal as in a rule."""
    return _term(value, local_name)
