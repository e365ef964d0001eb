"""A SWRL rule as elements of an RDF/XML file, in the form in which Protégé writes them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Final
from xml.sax.saxutils import escape, quoteattr

from suave_des.knowledge.rule_syntax import KINDS, Atom, Named, Term, Variable
from suave_des.knowledge.rules import VARIABLE_IRIS, Rule
from suave_des.knowledge.vocabulary import OWL, RDF, RDFS, SWRL, SWRLA, XSD

_NAMES: Final = {RDF: "rdf", RDFS: "rdfs", OWL: "owl", SWRL: "swrl", SWRLA: "swrla"}
_INDENT: Final = "    "


class Prefixes:
    """Names of elements with the prefixes that a file has, or with declarations of those that it lacks."""

    def __init__(self, declared: Mapping[str, str]) -> None:
        self._names = dict(declared)
        self._missing: dict[str, str] = {}
        for iri, wish in _NAMES.items():
            if iri not in self._names:
                while wish in self._names.values():
                    wish += "_"
                self._names[iri] = self._missing[iri] = wish

    def name(self, namespace: str, local: str) -> str:
        """A name with its prefix."""
        return f"{self._names[namespace]}:{local}"

    def declarations(self) -> str:
        """Attributes for an element under which names are used that the file has no prefix for."""
        return "".join(f' xmlns:{prefix}="{iri}"' for iri, prefix in self._missing.items())


def enabled_mark(prefixes: Prefixes, *, enabled: bool) -> str:
    """The mark swrla:isRuleEnabled as a line under a rule's first tag."""
    name = prefixes.name(SWRLA, "isRuleEnabled")
    datatype = f'{prefixes.name(RDF, "datatype")}="{XSD}boolean"'
    word = "true" if enabled else "false"
    return f"\n{_INDENT * 2}<{name}{prefixes.declarations()} {datatype}>{word}</{name}>"


def rule_elements(rule: Rule, prefixes: Prefixes, known: Collection[str]) -> str:
    """The elements to add to a file for a rule.

    Args:
        rule: the rule.
        prefixes: of the file.
        known: IRIs that the file says something of, which need no declaration.
    """
    top = prefixes.declarations()
    declared = [
        *((VARIABLE_IRIS[0] + name, SWRL + "Variable") for atom in rule.atoms for name in atom.variables()),
        *((atom.predicate, SWRL + "Builtin") for atom in rule.body if atom.kind == "builtin"),
        (SWRLA + "isRuleEnabled", OWL + "AnnotationProperty"),
    ]
    description = prefixes.name(RDF, "Description")
    text = ""
    for iri, kind in dict.fromkeys(declared):
        if iri not in known:
            about = f"{prefixes.name(RDF, 'about')}={quoteattr(iri)}"
            text += f"{_INDENT}<{description}{top} {about}>\n{_INDENT * 2}{_resource(prefixes, RDF, 'type', kind)}\n"
            text += f"{_INDENT}</{description}>\n"
    label = prefixes.name(RDFS, "label")
    text += f"{_INDENT}<{description}{top}>"
    text += enabled_mark(Prefixes({**_names_of(prefixes)}), enabled=rule.enabled)
    text += f"\n{_INDENT * 2}<{label}>{escape(rule.name)}</{label}>\n"
    text += f"{_INDENT * 2}{_resource(prefixes, RDF, 'type', SWRL + 'Imp')}\n"
    for side, atoms in (("body", rule.body), ("head", rule.head)):
        items = ["".join(_atom(prefixes, atom)) for atom in atoms]
        text += "\n".join(_INDENT * 2 + line for line in _list(prefixes, SWRL, side, SWRL + "AtomList", items)) + "\n"
    return text + f"{_INDENT}</{description}>\n"


def _names_of(prefixes: Prefixes) -> dict[str, str]:
    """All prefixes, as if they were declared: they are, on the element around."""
    return {iri: prefixes.name(iri, "").rstrip(":") for iri in _NAMES}


def _resource(prefixes: Prefixes, namespace: str, local: str, iri: str) -> str:
    return f"<{prefixes.name(namespace, local)} {prefixes.name(RDF, 'resource')}={quoteattr(iri)}/>"


def _list(prefixes: Prefixes, namespace: str, local: str, kind: str, items: list[str]) -> Iterator[str]:
    """A property whose value is a list; flat on the page, since nesting costs an indentation an item."""
    name, description = prefixes.name(namespace, local), prefixes.name(RDF, "Description")
    first, rest = prefixes.name(RDF, "first"), prefixes.name(RDF, "rest")
    if not items:
        yield _resource(prefixes, namespace, local, RDF + "nil")
        return
    opening = f"<{name}>"
    for item in items:
        yield f"{opening}<{description}>{_resource(prefixes, RDF, 'type', kind)}"
        yield f"{_INDENT}{item if item.startswith(f'<{first} ') else f'<{first}>{item}</{first}>'}"
        opening = f"<{rest}>"
    closing = f"{_resource(prefixes, RDF, 'rest', RDF + 'nil')}</{description}>"
    yield closing + f"</{rest}></{description}>" * (len(items) - 1) + f"</{name}>"


def _atom(prefixes: Prefixes, atom: Atom) -> Iterator[str]:
    description = prefixes.name(RDF, "Description")
    kind = next(name for name, known in KINDS.items() if known == atom.kind)
    yield f"<{description}>{_resource(prefixes, RDF, 'type', kind)}"
    predicates = {"class": "classPredicate", "range": "dataRange", "builtin": "builtin"}
    predicate = predicates.get(atom.kind, "propertyPredicate" if atom.kind in ("object", "data") else None)
    if predicate is not None:
        yield _resource(prefixes, SWRL, predicate, atom.predicate)
    if atom.kind == "builtin":
        items = [_value(prefixes, prefixes.name(RDF, "first"), term) for term in atom.arguments]
        yield from _list(prefixes, SWRL, "arguments", RDF + "List", items)
    else:
        for number, term in enumerate(atom.arguments, start=1):
            yield _value(prefixes, prefixes.name(SWRL, f"argument{number}"), term)
    yield f"</{description}>"


def _value(prefixes: Prefixes, name: str, term: Term) -> str:
    if isinstance(term, Variable | Named):
        iri = VARIABLE_IRIS[0] + term.name if isinstance(term, Variable) else term.iri
        return f"<{name} {prefixes.name(RDF, 'resource')}={quoteattr(iri)}/>"
    if term.datatype.startswith("@"):
        attribute = f'xml:lang="{term.datatype[1:]}"'
    else:
        attribute = f"{prefixes.name(RDF, 'datatype')}={quoteattr(term.datatype)}"
    # A carriage return would be read back as a line break.
    return f"<{name} {attribute}>{escape(term.text, {chr(13): '&#13;'})}</{name}>"
