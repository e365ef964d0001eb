"""Pieces of RDF/XML for the tests: individuals and rules, as an author would add them to
suave.owl.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.sax.saxutils import escape

import pytest

from suave_des.resources import shipped_folder

MakeOntology = Callable[..., Path]
"""Makes a changed copy of suave.owl: the fixture `suave_copy`."""


@pytest.fixture
def suave_copy(tmp_path: Path) -> MakeOntology:
    """A copy of the shipped suave.owl in a folder of its own, with text replaced and individuals
    added.
    """

    def make(
        extra: str = "", replace: Mapping[str, str] | None = None, name: str = "suave.owl"
    ) -> Path:
        text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
        for old, new in (replace or {}).items():
            assert old in text, f"{old!r} is not in the shipped suave.owl"
            text = text.replace(old, new)
        path = tmp_path / name
        path.write_text(text.replace("</rdf:RDF>", extra + "</rdf:RDF>"), encoding="utf-8")
        return path

    return make


SUAVE = "http://www.metacontrol.org/suave#"
TOMASYS = "http://metacontrol.org/tomasys#"
MROS = "http://ros/mros#"
XSD = "http://www.w3.org/2001/XMLSchema#"
SWRL = "http://www.w3.org/2003/11/swrl#"
SWRLB = "http://www.w3.org/2003/11/swrlb#"
BUILTINS = {"lessThan", "greaterThan", "add", "lessThn", "multiply"}


def iri(name: str) -> str:
    prefix, _, local = name.rpartition(":")
    return {"": SUAVE, "tomasys": TOMASYS, "mros": MROS}[prefix] + local


def individual(name: str, kind: str, *statements: tuple[str, str]) -> str:
    """An individual; a value that starts with a digit is a decimal, true/false a boolean, ":x" an
    individual.
    """
    lines = [
        f'<owl:NamedIndividual rdf:about="{iri(name)}">',
        f'<rdf:type rdf:resource="{TOMASYS}{kind}"/>',
    ]
    for property_name, value in statements:
        tag = property_name if ":" in property_name else f"tomasys:{property_name}"
        if value.startswith(":"):
            lines.append(f'<{tag} rdf:resource="{iri(value[1:])}"/>')
        else:
            kind_of = (
                "decimal"
                if value[0].isdigit()
                else "boolean"
                if value in ("true", "false")
                else "string"
            )
            lines.append(f'<{tag} rdf:datatype="{XSD}{kind_of}">{escape(value)}</{tag}>')
    return "\n".join([*lines, "</owl:NamedIndividual>\n"])


def rule(
    name: str, text: str, *, enabled: bool = True, data: frozenset[str] | set[str] = frozenset()
) -> str:
    """A SWRL rule from text such as 'QAvalue(?q) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.25) ->
    ...'.
    """
    body, head = text.split("->")
    variables = "".join(
        f'<rdf:Description rdf:about="urn:swrl:var#{v}"><rdf:type rdf:resource="{SWRL}Variable"/></rdf:Description>\n'
        for v in sorted(set(re.findall(r"\?(\w+)", text)))
    )
    sides = "".join(
        f"<swrl:{side}>{_list([_atom(part.strip(), data) for part in atoms.split('^')])}</swrl:{side}>"
        for side, atoms in (("body", body), ("head", head))
    )
    return (
        f'{variables}<rdf:Description><rdf:type rdf:resource="{SWRL}Imp"/><rdfs:label>{name}</rdfs:label>'
        f'<swrla:isRuleEnabled rdf:datatype="{XSD}boolean">{str(enabled).lower()}</swrla:isRuleEnabled>'
        f"{sides}</rdf:Description>\n"
    )


def _list(items: list[str]) -> str:
    text = f'<rdf:rest rdf:resource="{RDF}nil"/>'
    for item in reversed(items):
        text = (
            f'<rdf:rest><rdf:Description><rdf:type rdf:resource="{SWRL}AtomList"/><rdf:first>{item}</rdf:first>'
            f"{text}</rdf:Description></rdf:rest>"
        )
    return text.removeprefix("<rdf:rest>").removesuffix("</rdf:rest>")


RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
DATA = {
    *(
        "c_status",
        "fg_status",
        "o_status",
        "fd_realisability",
        "o_updatable",
        "o_always_improve",
        "hasValue",
    ),
    *(
        "b_status",
        "cc_unique",
        "cc_availability",
        "cspec_availability",
        "fd_efficacy",
        "qa_critical",
    ),
}


def _term(text: str) -> str:
    text = text.removeprefix(":")
    if text.startswith("?"):
        return f'rdf:resource="urn:swrl:var#{text[1:]}"/>'
    if text.startswith('"'):
        return f'rdf:datatype="{XSD}string">{escape(text[1:-1])}</'
    if text in ("true", "false"):
        return f'rdf:datatype="{XSD}boolean">{text}</'
    if text[0].isdigit():
        return f'rdf:datatype="{XSD}decimal">{text}</'
    return f'rdf:resource="{iri(text)}"/>'


def _element(tag: str, text: str) -> str:
    body = _term(text)
    return f"<{tag} {body}" if body.endswith("/>") else f"<{tag} {body}{tag}>"


def _atom(text: str, data: frozenset[str] | set[str]) -> str:
    found = re.fullmatch(r"([\w:]+)\((.*)\)", text)
    assert found is not None, text
    name, arguments = (
        found.group(1),
        [part.strip() for part in re.findall(r'\s*"[^"]*"|[^,]+', found.group(2)) if part.strip()],
    )
    if name in BUILTINS:
        items = f'<rdf:rest rdf:resource="{RDF}nil"/>'
        for argument in reversed(arguments):
            first = _element("rdf:first", argument)
            node = f'<rdf:Description><rdf:type rdf:resource="{RDF}List"/>{first}{items}</rdf:Description>'
            items = f"<rdf:rest>{node}</rdf:rest>"
        items = items.removeprefix("<rdf:rest>").removesuffix("</rdf:rest>")
        return (
            f'<rdf:Description><rdf:type rdf:resource="{SWRL}BuiltinAtom"/>'
            f'<swrl:builtin rdf:resource="{SWRLB}{name}"/><swrl:arguments>{items}</swrl:arguments></rdf:Description>'
        )
    term = iri(name) if ":" in name else TOMASYS + name
    if len(arguments) == 1:
        kind, predicate = "ClassAtom", "classPredicate"
    else:
        is_data = name in DATA or name in data
        kind, predicate = (
            "DatavaluedPropertyAtom" if is_data else "IndividualPropertyAtom",
            "propertyPredicate",
        )
    values = "".join(
        _element(f"swrl:argument{n}", argument) for n, argument in enumerate(arguments, start=1)
    )
    return (
        f'<rdf:Description><rdf:type rdf:resource="{SWRL}{kind}"/><swrl:{predicate} rdf:resource="{term}"/>'
        f"{values}</rdf:Description>"
    )
