"""Ontologies in Turtle mean what they mean in RDF/XML."""

from pathlib import Path

import pytest
import rdflib
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.errors import InputError
from suave_des.kb.rule_editor import add_rules
from suave_des.knowledge.checks import Subject
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import read_ontology
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.resources import find
from tests.helpers.checks import findings_of

MINE = """
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix suave: <http://www.metacontrol.org/suave#> .
@prefix tomasys: <http://metacontrol.org/tomasys#> .

<http://x.org/mine> a owl:Ontology ;
    owl:imports <http://www.metacontrol.org/suave> .

suave:fd_deep a tomasys:FunctionDesign ;
    tomasys:solvesF suave:f_generate_search_path ;
    tomasys:hasQAestimation [ a tomasys:QAvalue ; tomasys:isQAtype suave:salinity ;
                              tomasys:hasValue 3.0 ] .
"""


@pytest.fixture(params=["turtle", "nt"])
def converted(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """The shipped suave.owl in another notation."""
    path = tmp_path / ("suave.ttl" if request.param == "turtle" else "suave.nt")
    graph = rdflib.Graph().parse(find("suave.owl", "ontology"), format="xml")
    graph.serialize(path, format=request.param, encoding="utf-8")
    return path


def test_the_shipped_ontology_says_the_same_in_another_notation(converted):
    shipped, read = Ontology.load([find("suave.owl", "ontology")]), Ontology.load([converted])
    assert {(rule.name, rule.text) for rule in read.rules} == {
        (rule.name, rule.text) for rule in shipped.rules
    }
    assert read.functions == shipped.functions
    assert {name: read.expected(name) for name in read.designs("f_generate_search_path")} == {
        name: shipped.expected(name) for name in shipped.designs("f_generate_search_path")
    }
    state = KnowledgeState.of(
        [ObjectiveState("f_maintain_motion", None)],
        groundings={"f_maintain_motion": "fd_all_thrusters"},
        components={"c_thruster_1": "FALSE"},
    )
    before, after = (Reasoner(each).analyze(state).statuses for each in (shipped, read))
    assert before == after and before


def test_an_ontology_in_it_imports_another_by_name(tmp_path, converted):
    mine = tmp_path / "mine.ttl"
    mine.write_text(MINE.replace("suave:salinity", "suave:water_visibility"))
    ontology = Ontology.load([mine])
    assert "fd_deep" in ontology.designs("f_generate_search_path")
    assert converted in ontology.files


def test_what_is_wrong_in_it_is_told_with_its_line(tmp_path):
    mine = tmp_path / "mine.ttl"
    mine.write_text(MINE)
    found = {
        each.message.split(":")[0]: (each.file, each.line) for each in findings_of(Subject([mine]))
    }
    assert found["fd_deep"] == (str(mine), 9)
    assert found["an individual without a name"] == (str(mine), None)  # whose attribute is nowhere


@settings(max_examples=60, deadline=None)
@given(at=st.integers(0, len(MINE)), deleted=st.integers(0, 20), added=st.text(max_size=8))
def test_damage_is_read_or_is_one_plain_error(at, deleted, added):
    damaged = MINE[:at] + added + MINE[at + deleted :]
    content = damaged.encode(errors="surrogatepass")
    try:
        read_ontology(Path("mine.ttl"), content)
    except InputError as error:
        assert str(error).startswith("mine.ttl: ") and "\n" not in str(error)


def test_rules_in_it_cannot_be_edited(converted):
    before = converted.read_bytes()
    with pytest.raises(
        InputError, match=r"suave\.\w+: rules can be edited in RDF/XML only .*--rules"
    ):
        add_rules(converted, 'mine: Component(?c) -> c_status(?c, "OK")')
    assert converted.read_bytes() == before
