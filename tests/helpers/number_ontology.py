"""An ontology of things with a number each, in many datatypes and forms, and rules that match the
numbers.
"""

from __future__ import annotations

from pathlib import Path

import rdflib

from suave_des.knowledge.ontology import Ontology
from tests.helpers.owl_text import XSD

NS = "http://example.org/numbers#"
NUMBERS = {
    "integer": '"3"^^xsd:integer',
    "padded": '"03"^^xsd:integer',
    "int": '"3"^^xsd:int',
    "whole_decimal": '"3"^^xsd:decimal',
    "decimal": '"3.0"^^xsd:decimal',
    "long_decimal": '"3.00"^^xsd:decimal',
    "half": '"1.5"^^xsd:decimal',
    "long_half": '"1.50"^^xsd:decimal',
    "whole_double": '"3"^^xsd:double',
    "double": '"3.0"^^xsd:double',
    "negative": '"-2"^^xsd:decimal',
    "long_negative": '"-2.0"^^xsd:decimal',
}
HEADER = f"""\
@prefix : <{NS}> . @prefix owl: <http://www.w3.org/2002/07/owl#> . @prefix xsd: <{XSD}> .
<{NS[:-1]}> a owl:Ontology .
:Thing a owl:Class . :first a owl:DatatypeProperty . :second a owl:DatatypeProperty . :same a owl:ObjectProperty .
:is a owl:DatatypeProperty . :doubled a owl:DatatypeProperty . :equals a owl:ObjectProperty .
"""


def numbers_ontology(folder: Path) -> Ontology:
    """Write and load it: rule is_NAME says of each thing with a number like that of thing NAME
    is(thing, NAME).
    """
    owl, rules = folder / "numbers.owl", folder / "numbers.swrl"
    things = [
        f":{name} a :Thing ; :first {text} ; :second {text} .\n" for name, text in NUMBERS.items()
    ]
    # it would write numbers in one form
    before, rdflib.NORMALIZE_LITERALS = (
        rdflib.NORMALIZE_LITERALS,
        False,
    )
    rdflib.Graph().parse(data=HEADER + "".join(things), format="turtle").serialize(
        owl, format="xml"
    )
    rdflib.NORMALIZE_LITERALS = before
    known = [
        f'is_{name}: first(?x, {text}) -> is(?x, "{name}")\n' for name, text in NUMBERS.items()
    ]
    known += [
        "same: first(?x, ?v) ^ second(?y, ?v) -> same(?x, ?y)\n",
        "equal: first(?x, ?v) ^ second(?y, ?w) ^ swrlb:equal(?v, ?w) -> equals(?x, ?y)\n",
        *(
            f'sum_{name}: first(?x, {text}) ^ first(?x, ?v) ^ swrlb:add(?w, ?v, 1.5) ^ first(?y, ?w) -> is(?y, "sum")\n'
            for name, text in NUMBERS.items()
        ),
        "double: first(?x, ?v) ^ swrlb:multiply(?w, ?v, 2) -> doubled(?x, ?w)\n",
    ]
    rules.write_text("".join(known), encoding="utf-8")
    return Ontology.load([owl], rules=[rules])
