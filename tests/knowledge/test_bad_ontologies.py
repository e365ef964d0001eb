"""Each way in which an ontology file can be unusable is one clear line with file and place; other
formats are read.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from suave_des.errors import InputError
from suave_des.knowledge.checks import Subject
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import read_ontology
from suave_des.knowledge.reasoner import Reasoner
from tests.helpers.checks import findings_of, only
from tests.helpers.knowledge_states import searching
from tests.helpers.owl_text import individual, rule

HEAD = '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:owl="http://www.w3.org/2002/07/owl#">\n'
NESTED = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">\n' for n in range(1, 10))
BAD_FILES: dict[str, tuple[str, str]] = {
    "empty": ("", "empty"),
    "text": ("404: Not Found", "line 1, column 1: not well-formed XML"),
    "truncated": (
        HEAD + '<owl:Ontology rdf:about="http://x.org/y">\n',
        "line 3, column 1: not well-formed XML: Premature end of data in tag Ontology line 2",
    ),
    "web page": ("<!DOCTYPE html>\n<html><body/></html>", "the root element is <html>"),
    "owl/xml": (
        '<?xml version="1.0"?>\n<Ontology xmlns="http://www.w3.org/2002/07/owl#"/>',
        "bad.owl: this is OWL/XML (save it as RDF/XML",
    ),
    "turtle": ("# mine\n@prefix : <http://x.org/y#> .\n", "not OWL: there is no owl:Ontology"),
    "bad turtle": (
        "@prefix : <http://x.org/y#> .\n:a :b q:c .\n",
        'bad.owl: line 2: not Turtle: Prefix "q:" not bound',
    ),
    "nested turtle": ("@prefix : <http://x.org/y#> .\n:a :b " + "(" * 100_000, "not Turtle"),
    "n-triples": ("<http://x.org/y> <http://x.org/z> <http://x.org/y> .\n", "no owl:Ontology"),
    "iri with half an address": (
        "<http://x.org/y> <http://[x> <http://x.org/y> .\n",
        "is not an IRI",
    ),
    "functional": ("Prefix(:=<http://x.org/y#>)\n", "this is OWL in Functional Syntax"),
    "manchester": ("Prefix: : <http://x.org/y#>\n", "this is OWL in Manchester Syntax"),
    "json": ('{"@context": {}}', "this is JSON-LD"),
    "bad rdf": (
        HEAD + '<owl:Ontology rdf:about="http://x.org/y" rdf:ID="z"/></rdf:RDF>',
        "not RDF/XML",
    ),
    "spaces in an iri": (
        HEAD + '<owl:Ontology rdf:about="http://x.org/a b"/></rdf:RDF>',
        "is not an IRI",
    ),
    "external entity": (
        '<!DOCTYPE r [\n<!ENTITY x SYSTEM "file:///etc/passwd">]>' + HEAD + "</rdf:RDF>",
        "line 2: its DOCTYPE or an entity refers to another file",
    ),
    "external dtd": (
        '<!DOCTYPE r SYSTEM "http://x.org/r.dtd">' + HEAD + "</rdf:RDF>",
        "line 1: its DOCTYPE or an entity refers",
    ),
    "parameter entity": (
        '<!DOCTYPE r [<!ENTITY % p SYSTEM "file:///etc/passwd">\n%p;]>' + HEAD + "</rdf:RDF>",
        "line 1: its DOCTYPE or an entity refers",
    ),
    "unused parameter entity": (
        '<!DOCTYPE r [\n<!ENTITY % p SYSTEM "http://x.org/p">]>' + HEAD + "</rdf:RDF>",
        "line 2: its DOCTYPE or an entity refers",
    ),
    "entity bomb": (
        f'<!DOCTYPE r [<!ENTITY e0 "lol">\n{NESTED}]>' + HEAD + "&e9;</rdf:RDF>",
        "expand to far more than its size",
    ),
    "entity bomb in an attribute": (
        f'<!DOCTYPE r [<!ENTITY e0 "lol">\n{NESTED}]>'
        + HEAD
        + '<owl:Ontology rdf:about="&e9;"/></rdf:RDF>',
        "expand to far more than its size",
    ),
    "much repeated entity": (
        f'<!DOCTYPE r [<!ENTITY e "{"x" * 500}">]>' + HEAD + "&e;" * 20000 + "</rdf:RDF>",
        "expand to far more than its size",
    ),
}


def problem_of(call: Callable[[], object]) -> str:
    with pytest.raises(InputError) as error:
        call()
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_file_is_told_with_its_place(tmp_path, name):
    text, expected = BAD_FILES[name]
    path = tmp_path / "bad.owl"
    path.write_text(text, encoding="utf-8")
    problem = problem_of(lambda: Ontology.load([path]))
    assert problem.startswith(f"{path}: ")
    assert expected in problem


def test_simple_entities_as_protege_writes_them_are_read(suave_copy, kb):
    entities = (
        '<?xml version="1.0"?>\n<!DOCTYPE rdf:RDF [\n<!ENTITY suave "http://www.metacontrol.org/suave#" >\n'
        '<!ENTITY xsd "http://www.w3.org/2001/XMLSchema#" >\n]>'
    )
    path = suave_copy(
        replace={
            '<?xml version="1.0"?>': entities,
            'rdf:resource="http://www.metacontrol.org/suave#': 'rdf:resource="&suave;',
            'rdf:datatype="http://www.w3.org/2001/XMLSchema#': 'rdf:datatype="&xsd;',
        }
    )
    base = Ontology.load([path])
    assert base.facts == kb.facts
    assert [one.text for one in base.rules] == [one.text for one in kb.rules]


@pytest.mark.parametrize(
    ("value", "datatype"),
    [
        ("deep", "decimal"),
        ("2.25", "double"),
        ("2.25", "string"),
        ("1e3", "decimal"),
        ("NaN", "decimal"),
    ],
)
def test_a_value_that_is_no_decimal_is_told_with_line(suave_copy, value, datatype):
    old = '#decimal">3.25<'
    path = suave_copy(replace={old: f'#{datatype}">{value}<'})
    problem = problem_of(lambda: Ontology.load([path]))
    line = 1 + path.read_text().split(
        'NamedIndividual rdf:about="http://www.metacontrol.org/suave#qa_water_visibility_high"'
    )[0].count("\n")
    assert (
        f"{path}: line {line}: qa_water_visibility_high: hasValue '{value}' is not an xsd:decimal"
        in problem
    )
    subject = Subject([path], reaction_thresholds_m=(3.25, 2.25, 1.25))
    assert only(findings_of(subject), "is not an xsd:decimal").line == line


def test_two_values_of_a_functional_property_are_reported_with_line(suave_copy):
    path = suave_copy(individual("qa_water_visibility_high", "QAvalue", ("hasValue", "9")))
    problem = problem_of(lambda: Ontology.load([path]))
    assert problem.startswith(f"{path}: line ")
    assert "contradiction: the functional property hasValue has the values 3.25 and 9" in problem


@pytest.mark.parametrize("name", ["pellet", "owlready2"])
def test_an_ontology_whose_rules_contradict_it_is_reported(suave_copy, name):
    text = "QAvalue(?q) ^ isQAtype(?q, :water_visibility) -> hasValue(?q, 3.25)"
    path = suave_copy(rule("levelling", text))
    base = Ontology.load([path])
    problem = problem_of(lambda: Reasoner(base, name).analyze(searching()))
    assert "contradiction: individual qa_water_visibility_" in problem
    assert (
        "has more than one value for the functional property hasValue, by the rule levelling (suave.owl, line "
        in problem
    )
    assert str(path) in problem


@pytest.mark.parametrize("name", ["odd", "fd_spiral_high"])
def test_a_contradictions_rule_is_not_looked_for_where_an_individual_of_its_name_is(
    suave_copy, name
):
    odd = '<owl:NamedIndividual rdf:about="http://example.org/#odd"/>\n'
    path = suave_copy(
        odd + rule(name, "QAvalue(?q) ^ isQAtype(?q, :water_visibility) -> hasValue(?q, 3.25)")
    )
    problem = problem_of(lambda: Reasoner(Ontology.load([path]), "pellet").analyze(searching()))
    labels = [
        line
        for line, text in enumerate(path.read_text().splitlines(), 1)
        if f"label>{name}<" in text
    ]
    assert f"by the rule {name} (suave.owl, line {labels[-1]})" in problem


@pytest.mark.parametrize("name", ["pellet", "owlready2"])
def test_a_conclusion_outside_its_propertys_range_is_reported(suave_copy, name):
    path = suave_copy(rule("odd", "FunctionGrounding(?g) -> fg_status(?g, 3.5)"))
    reasoner = Reasoner(Ontology.load([path]), name)
    problem = problem_of(lambda: reasoner.analyze(searching("fd_spiral_low")))
    assert "contradiction: " in problem
    assert "by the rule odd (suave.owl, line " in problem


@pytest.mark.parametrize("name", ["pellet", "owlready2"])
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("QAvalue(?q) ^ hasValue(?q, ?v) ^ lessThn(?v, 1.0) -> hasValue(?q, 1.0)", "lessThn"),
        ('Objective(?o) -> o_status(?p, "IN_ERROR_FR")', ""),
    ],
)
def test_a_rule_that_pellet_would_drop_is_an_error(suave_copy, text, reason, name):
    path = suave_copy(rule("odd", text))
    base = Ontology.load([path])
    problem = problem_of(lambda: Reasoner(base, name).analyze(searching()))
    assert f"{path}: rule odd: Pellet does not use rule odd" in problem
    assert reason in problem
    assert "urn:suave-des" not in problem


def test_a_rule_that_uses_an_object_property_for_data_is_an_error(suave_copy):
    text = 'FunctionGrounding(?g) ^ solvesO(?g, ?o) -> typeFD(?g, "x")'
    path = suave_copy(rule("odd", text, data={"typeFD"}))
    problem = problem_of(lambda: Ontology.load([path]))
    assert (
        f"{path}: rule odd: typeFD is declared as object property, but used as data property"
        in problem
    )


@pytest.mark.parametrize("encoding", ["UTF-16", "ISO-8859-1", "undefined"])
def test_xml_is_read_in_the_encoding_that_it_declares_or_as_utf_8(encoding, shipped, tmp_path):
    text = (shipped / "suave.owl").read_text(encoding="utf-8")
    declared = re.sub(r"<\?xml[^>]*\?>", f'<?xml version="1.0" encoding="{encoding}"?>', text)
    path = tmp_path / "suave.owl"
    path.write_bytes(
        declared.replace("fd_spiral_low", "fd_spiral_bröd").encode(
            {"undefined": "utf-8"}.get(encoding, encoding)
        )
    )
    base = Ontology.load([path])
    assert "fd_spiral_bröd" in base.designs("f_generate_search_path") and base.sources[0].line_of(
        "fd_spiral_bröd"
    )


def test_a_datatype_as_owlready2_saves_it_is_that_of_xml_schema(shipped, tmp_path):
    text = (shipped / "suave.owl").read_text(encoding="utf-8")
    path = tmp_path / "suave.owl"
    path.write_text(
        text.replace(
            "<tomasys:qa_comparison_operator>",
            '<tomasys:qa_comparison_operator rdf:datatype="xsd:string">',
        ),
        encoding="utf-8",
    )
    assert Ontology.load([path]).facts == Ontology.load().facts


def test_an_ontology_in_one_line_with_entities_is_read(tmp_path):
    content = '<owl:Ontology rdf:about="http://x.org/y"/><owl:Class rdf:about="&y;A"/>'
    doctype = '<!DOCTYPE rdf:RDF [<!ENTITY y "http://x.org/y#">]>'
    path = tmp_path / "line.owl"
    path.write_text(f"<?xml version='1.0'?>{doctype}{HEAD.strip()}{content}</rdf:RDF>")
    assert read_ontology(path).kinds("http://x.org/y#A") == ["http://www.w3.org/2002/07/owl#Class"]
