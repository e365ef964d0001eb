"""What an individual is depends on its classes and properties, not on the form of its name."""

import pytest

from suave_des.errors import Level
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import RDF_TYPE, XSD, Lit, Names, value_of
from suave_des.knowledge.reasoner import Reasoner
from tests.helpers.checks import found_by_pellet, subject
from tests.helpers.knowledge_states import SEARCH, searching
from tests.helpers.owl_text import individual

SUAVE = "http://www.metacontrol.org/suave#"


def decide(path, state):
    reasoner = Reasoner(Ontology.load([path]), "pellet")
    (decision,) = reasoner.plan(reasoner.analyze(state)).decisions
    return decision


def test_an_objective_counts_under_any_name(suave_copy):
    """It is that of the function to which its typeF leads."""
    path = suave_copy(
        individual("nfr", "QAvalue", ("isQAtype", ":mros:performance"), ("hasValue", "0.4"))
        + individual("find_it", "Objective", ("typeF", f":{SEARCH}"), ("hasNFR", ":nfr"))
    )
    decision = decide(path, searching(None, 3.5, status="UNGROUNDED"))
    assert [each.design for each in decision.rejected] == ["fd_spiral_low"]
    assert decision.rejected[0].reason == "performance 0.25 expected < 0.40 required"


def test_an_objective_under_any_name_has_the_status_that_rules_conclude(suave_copy):
    path = suave_copy(individual("find_it", "Objective", ("typeF", f":{SEARCH}")))
    base = Ontology.load([path])
    inference = Reasoner(base, "pellet").analyze(searching("fd_spiral_high", 1.3))
    assert inference.objective_status(SEARCH) == "IN_ERROR_NFR"
    assert "o_status(find_it, IN_ERROR_NFR)" in map(str, inference.facts)


def test_a_grounding_counts_under_any_name(suave_copy):
    path = suave_copy(individual("climbing", "FunctionGrounding", ("typeFD", ":fd_spiral_high")))
    base = Ontology.load([path])
    inference = Reasoner(base, "pellet").analyze(searching("fd_spiral_high", 1.3))
    assert inference.grounding_status(SEARCH) == "IN_ERROR_NFR"


def test_of_several_objectives_of_a_function_that_of_the_usual_name_counts(suave_copy):
    objectives = (
        individual(name, "Objective", ("typeF", f":{SEARCH}"))
        for name in ("find_it", "o_generate_search_path")
    )
    assert (
        Ontology.load([suave_copy("".join(objectives))]).objectives[SEARCH]
        == "o_generate_search_path"
    )


@pytest.mark.parametrize(
    ("text", "value"), [("true", True), ("1", True), (" 1\n", True), ("false", False), ("0", False)]
)
def test_a_truth_value_is_read_in_each_form_that_xml_schema_has(text, value):
    assert value_of(Lit(text, XSD + "boolean"), Names(())) is value


def test_a_name_that_two_things_share_is_written_in_full():
    one, other, alone = "http://a.org/#thing", "http://b.org/#thing", "http://a.org/#alone"
    names = Names((each, RDF_TYPE, "http://a.org/#Thing") for each in (one, other, alone))
    assert [names.short(each) for each in (one, other, alone)] == [one, other, "alone"]


@pytest.fixture(
    scope="module", params=["o_generate_search_path", "fg_spiral_high", "obs_water_visibility"]
)
def namesake(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Ontology]:
    """A usual name that something else has."""
    extra = individual(request.param, "ComponentClass")
    given = subject(tmp_path_factory.mktemp("namesake"), extra=extra)
    return request.param, Ontology.load(given.ontologies)


def test_something_else_of_a_usual_name_stays(namesake):
    name, base = namesake
    assert f"ComponentClass({name})" in map(str, base.facts)


def test_something_else_of_a_usual_name_is_not_taken_for_what_has_it(namesake):
    inference = Reasoner(namesake[1], "pellet").analyze(searching("fd_spiral_high", 1.3))
    assert inference.objective_status(SEARCH) == "IN_ERROR_NFR"
    assert inference.grounding_status(SEARCH) == "IN_ERROR_NFR"


@pytest.mark.parametrize(
    "kind",
    ["Transitive", "Symmetric", "Asymmetric", "Reflexive", "Irreflexive", "InverseFunctional"],
)
def test_a_property_is_defined_by_what_only_object_properties_are(suave_copy, tmp_path, kind):
    declared = f'<rdf:Description rdf:about="{SUAVE}near"><rdf:type rdf:resource="http://www.w3.org/2002/07/owl#{kind}Property"/></rdf:Description>'
    rules = tmp_path / "mine.swrl"
    rules.write_text("R: near(?x, ?y) -> fd_error_log(?x, ?y)\n", encoding="utf-8")
    base = Ontology.load([suave_copy(declared)], rules=[rules])
    assert base.vocabulary.kinds[SUAVE + "near"] == {"object property"}


@pytest.mark.parametrize("backend", ["pellet", "owlready2"])
def test_any_name_comes_back_from_java_as_it_is(suave_copy, backend):
    path, name = suave_copy(), "fd_spiral_'\U0001f600"
    text = path.read_text(encoding="utf-8").replace("#fd_spiral_high", f"#{name}")
    path.write_text(text, encoding="utf-8")
    inference = Reasoner(Ontology.load([path]), backend).analyze(searching(name, 1.3))
    assert set(map(str, inference.facts)) == {
        f"fg_status(fg_{name.removeprefix('fd_')}, IN_ERROR_NFR)",
        "o_status(o_generate_search_path, IN_ERROR_NFR)",
    }


def test_axioms_that_pellet_ignores_are_reported(tmp_path):
    """A transitive property has no limit on the number of its values in OWL DL."""
    kinds = "".join(
        f'<rdf:type rdf:resource="http://www.w3.org/2002/07/owl#{kind}Property"/>'
        for kind in ("Object", "Transitive", "Functional")
    )
    near = f'<rdf:Description rdf:about="{SUAVE}near">{kinds}</rdf:Description>'
    said = [each for each in found_by_pellet(tmp_path, extra=near) if "ignores" in each.message]
    assert [each.level for each in said] == [Level.WARN] * len(said)
    assert any("Ignoring transitivity" in each.message for each in said)


def test_what_java_prints_does_not_reach_the_terminal(suave_copy, tmp_path, capfd):
    """Pellet prints there which arguments a built-in fails on."""
    rules = tmp_path / "mine.swrl"
    rules.write_text(
        "R: hasValue(?q, ?v) ^ booleanNot(?v, true) -> fd_error_log(?q, ?q)\n",
        encoding="utf-8",
    )
    Reasoner(Ontology.load([suave_copy()], rules=[rules]), "pellet").analyze(searching(None, 1.3))
    assert capfd.readouterr() == ("", "")
