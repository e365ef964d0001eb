"""kb query: SPARQL over ontologies, states and inferences, and nothing else."""

import csv
import io
import json

import pytest

from suave_des.errors import InputError
from suave_des.kb import KnowledgeBase

SEARCH = "f_generate_search_path"


def test_asks_the_ontologies(knowledge):
    found = knowledge.query(f"SELECT ?d WHERE {{ ?d tomasys:solvesF suave:{SEARCH} }}")
    assert found.columns == ("d",)
    assert found.rows == (("suave:fd_spiral_high",), ("suave:fd_spiral_low",), ("suave:fd_spiral_medium",))


def test_inferred_facts_are_there_when_asked_for(knowledge):
    state = knowledge.state(groundings={SEARCH: "fd_spiral_high"}, measurements={"water_visibility": 1.8})
    query = "SELECT ?g ?s WHERE { ?g tomasys:fg_status ?s }"
    assert knowledge.query(query, state).rows == ()
    assert knowledge.query(query, state, inferred=True).rows == (("suave:fg_spiral_high", "IN_ERROR_NFR"),)
    assert knowledge.query("ASK { suave:fg_spiral_high a tomasys:FunctionGrounding }", state).rows == (("true",),)
    assert knowledge.query("ASK { suave:fg_spiral_high a tomasys:FunctionGrounding }").rows == (("false",),)


def test_answers_are_the_same_each_time():
    queries = ("SELECT ?s ?o WHERE { ?s ?p ?o } LIMIT 9", "SELECT ?s ?o WHERE { ?s owl:unionOf ?o }")
    first, second = ([KnowledgeBase.load().query(query).rows for query in queries] for _ in range(2))
    assert first == second
    assert all(first)


def test_columns_of_all_variables_are_by_name(knowledge):
    found = knowledge.query("SELECT  * WHERE { ?zone suave:on ?a ; suave:to ?m . ?b suave:of ?z1, ?c, [] }")
    assert found.columns == ("a", "b", "c", "m", "z1", "zone")


@pytest.mark.parametrize(
    ("query", "notes"),
    [
        ("SELECT ?d WHERE { ?d tomasys:solvsF ?f }", ["tomasys:solvsF (did you mean tomasys:solvesF?)"]),
        ("ASK { ?d a tomasys:FunctionDesing }", ["tomasys:FunctionDesing (did you mean tomasys:FunctionDesign?)"]),
        ("ASK { ?g suave:fg_status 1 FILTER NOT EXISTS { suave:f_x a ?c } }", ["suave:f_x", "suave:fg_status"]),
        (
            "SELECT ?d WHERE { ?d tomasys:solvesF/tomasys:fg_stat ?f }",
            ["tomasys:fg_stat (did you mean tomasys:fg_status?)"],
        ),
        ("SELECT ?d WHERE { ?d a tomasys:Wrench }", ["tomasys:Wrench"]),
        ("SELECT ?d WHERE { ?d tomasys:solvesF ?f . ?d rdfs:seeAlso 2 . ?f a suave:fd_spiral_low. }", []),
    ],
)
def test_names_that_the_knowledge_base_does_not_have_are_noted(knowledge, query, notes):
    noted = knowledge.query(query).unknown
    assert len(noted) == len(notes)
    assert all(one.startswith(begin) for one, begin in zip(noted, notes, strict=True))


def test_the_command_notes_unknown_names_on_its_error_stream(command):
    status, answer, noted = command("query", "SELECT ?d WHERE { ?d tomasys:solvsF ?f }")
    assert (status, answer) == (0, "d\nno rows\n")
    assert noted == "suave-des: the knowledge base does not have tomasys:solvsF (did you mean tomasys:solvesF?)\n"


def test_an_order_that_the_query_wants_is_kept(knowledge):
    found = knowledge.query(f"SELECT ?d WHERE {{ ?d tomasys:solvesF suave:{SEARCH} }} ORDER BY DESC(?d)")
    assert [row[0] for row in found.rows] == ["suave:fd_spiral_medium", "suave:fd_spiral_low", "suave:fd_spiral_high"]


def test_labels_are_there(knowledge):
    assert knowledge.query("SELECT ?l WHERE { suave:c_thruster_1 rdfs:label ?l }").rows == (("c_thruster_1",),)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("SELECT WHERE", "not a SPARQL query"),
        ("", "not a SPARQL query"),
        ("SELECT ?s WHERE { ?s nowhere:is ?o }", "not a SPARQL query: Unknown namespace prefix : nowhere"),
        ("DELETE WHERE { ?s ?p ?o }", "not a SPARQL query"),
        ("SELECT ?s WHERE { SERVICE <http://example.org/> { ?s ?p ?o } }", "SERVICE and FROM read from other sources"),
        ("SELECT ?s FROM <http://example.org/> WHERE { ?s ?p ?o }", "SERVICE and FROM read from other sources"),
    ],
)
def test_what_is_no_query_of_the_knowledge_base_is_refused(knowledge, text, said):
    with pytest.raises(InputError) as error:
        knowledge.query(text)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_the_command_prints_tables(command):
    words = ("query", "SELECT ?g ?s WHERE { ?g tomasys:fg_status ?s }", "--inferred")
    state = ("--at", f"{SEARCH}=fd_spiral_high", "--at", "water_visibility=1.8")
    status, text, _ = command(*words, *state)
    assert status == 0
    assert text.splitlines()[1].split() == ["suave:fg_spiral_high", "IN_ERROR_NFR"]
    _, text, _ = command(*words, *state, "--format", "csv")
    assert list(csv.DictReader(io.StringIO(text))) == [{"g": "suave:fg_spiral_high", "s": "IN_ERROR_NFR"}]
    _, text, _ = command(*words, "--format", "json")
    assert json.loads(text) == []
