"""Ontologies in other formats and encodings than RDF/XML in UTF-8 say the same."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import read_ontology


@pytest.mark.parametrize(("ending", "form"), [("ttl", "turtle"), ("nt", "nt")])
def test_the_format_goes_by_the_ending(ending: str, form: str, kb: Ontology, shipped: Path, tmp_path: Path) -> None:
    path = tmp_path / f"suave.{ending}"
    path.write_text(read_ontology(shipped / "suave.owl").graph.serialize(format=form), encoding="utf-8")
    base = Ontology.load([path])
    assert base.facts == kb.facts
    assert {rule.text for rule in base.rules} == {rule.text for rule in kb.rules}


@pytest.mark.parametrize("encoding", ["UTF-16", "ISO-8859-1"])
def test_xml_is_read_in_the_encoding_that_it_declares(encoding: str, shipped: Path, tmp_path: Path) -> None:
    text = (shipped / "suave.owl").read_text(encoding="utf-8")
    declared = re.sub(r"<\?xml[^>]*\?>", f'<?xml version="1.0" encoding="{encoding}"?>', text)
    path = tmp_path / "suave.owl"
    path.write_bytes(declared.replace("fd_spiral_low", "fd_spiral_bröd").encode(encoding))
    assert "fd_spiral_bröd" in Ontology.load([path]).designs("f_generate_search_path")


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("bad.ttl", "@prefix a: <http://x.org/#> .\na:b a:c .\n", "line 2: not Turtle: "),
        ("bad.nt", "<http://x.org/a> .\n", "not N-Triples: "),
    ],
)
def test_a_file_that_cannot_be_read_is_reported_by_its_format(
    name: str, content: str, problem: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(KnowledgeError) as caught:
        read_ontology(tmp_path / name)
    assert problem in str(caught.value)


def test_a_datatype_as_owlready2_saves_it_is_that_of_xml_schema(shipped: Path, tmp_path: Path) -> None:
    text = (shipped / "suave.owl").read_text(encoding="utf-8")
    path = tmp_path / "suave.owl"
    path.write_text(
        text.replace("<tomasys:qa_comparison_operator>", '<tomasys:qa_comparison_operator rdf:datatype="xsd:string">'),
        encoding="utf-8",
    )
    assert Ontology.load([path]).facts == Ontology.load().facts
