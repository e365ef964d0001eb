"""Each rule of the shipped ontologies concludes what it says, and nothing where its condition does
not hold.
"""

import re
from collections.abc import Callable, Mapping
from decimal import Decimal
from pathlib import Path

import pytest

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import OWL, RDF, RDFS, SWRL, SWRLA
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import Fact, Inference, KnowledgeState, ObjectiveState
from tests.helpers.checks import subject
from tests.helpers.knowledge_states import MOTION, SEARCH, searching
from tests.helpers.owl_text import MakeOntology, individual, rule


def inferred(reasoner: Reasoner, state: KnowledgeState) -> set[str]:
    return {str(fact) for fact in reasoner.analyze(state).facts}


def with_files(*files: Path) -> Reasoner:
    return Reasoner(Ontology.load(files), "pellet")


def test_the_enabled_rules_are_the_exemplars(kb):
    names = "QAWaterVisibility QAenergy QAsafety compErrFG compError compRecov mros_S4"
    numbered = "S1a S1b S1c S2 S3 S4 S5 S6a S6b S6c S9 S10 S11"
    assert {rule.name for rule in kb.rules if rule.enabled} == {*names.split(), *numbered.split()}


@pytest.mark.parametrize(
    ("design", "visibility", "in_error"),
    [
        ("fd_spiral_high", 3.2499, True),
        ("fd_spiral_high", 3.25, False),
        ("fd_spiral_medium", 2.25, False),
        ("fd_spiral_low", 1.25, False),
    ],
)
def test_visibility_below_what_the_design_expects_is_an_error(pellet, design, visibility, in_error):
    inference = pellet.analyze(searching(design, visibility))
    assert inference.grounding_status(SEARCH) == ("IN_ERROR_NFR" if in_error else None)
    assert inference.objective_status(SEARCH) == ("IN_ERROR_NFR" if in_error else None)


def with_a_failed_thruster(reasoner: Reasoner) -> Inference:
    state = searching(
        "fd_spiral_low", 2.0, motion="fd_all_thrusters", components={"c_thruster_3": "FALSE"}
    )
    return reasoner.analyze(state)


def test_what_follows_from_a_failed_thruster(pellet):
    assert set(map(str, with_a_failed_thruster(pellet).facts)) == {
        "fd_realisability(fd_all_thrusters, false)",
        "fg_status(fg_all_thrusters, IN_ERROR_COMPONENT)",
        "o_status(o_maintain_motion, IN_ERROR_COMPONENT)",
    }


@pytest.mark.parametrize(
    ("design", "is_realisable"), [("fd_all_thrusters", False), ("fd_recover_thrusters", True)]
)
def test_a_failed_thruster_makes_the_design_unrealisable_that_requires_it(
    pellet, design, is_realisable
):
    found = with_a_failed_thruster(pellet).values(design, "fd_realisability")
    assert found == (() if is_realisable else (False,))


def test_the_recovering_design_is_not_in_error_by_a_failed_thruster(pellet):
    state = searching(
        "fd_spiral_low", 2.0, motion="fd_recover_thrusters", components={"c_thruster_3": "FALSE"}
    )
    assert inferred(pellet, state) == {"fd_realisability(fd_all_thrusters, false)"}


def test_a_recovered_component_makes_every_objective_updatable(pellet):
    state = searching(
        "fd_spiral_low",
        2.0,
        motion="fd_recover_thrusters",
        components={"c_thruster_1": "RECOVERED"},
    )
    assert inferred(pellet, state) == {
        "o_updatable(o_generate_search_path, true)",
        "o_updatable(o_maintain_motion, true)",
    }


@pytest.fixture(scope="module", params=["energy", "safety"])
def limited(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[float], Inference]:
    """Infers from a measured value of which the search's objective requires at most 0.5."""
    attribute = request.param
    extra = (
        individual("nfr", "QAvalue", ("isQAtype", f":mros:{attribute}"), ("hasValue", "0.5"))
        + individual("qa_low", "QAvalue", ("isQAtype", f":mros:{attribute}"), ("hasValue", "0.9"))
        + individual("fd_spiral_low", "FunctionDesign", ("hasQAestimation", ":qa_low"))
        + individual("o_generate_search_path", "Objective", ("hasNFR", ":nfr"))
    )
    reasoner = with_files(*subject(tmp_path_factory.mktemp(attribute), extra=extra).ontologies)

    def infer(measured: float) -> Inference:
        state = KnowledgeState.of(
            [ObjectiveState(SEARCH)],
            groundings={SEARCH: "fd_spiral_low"},
            measurements={attribute: measured},
        )
        return reasoner.analyze(state)

    return infer


AROUND_THE_LIMIT = pytest.mark.parametrize(
    ("measured", "in_error"), [(0.6, True), (0.5, False), (0.4, False)]
)


@AROUND_THE_LIMIT
def test_more_than_the_objective_requires_is_an_error(limited, measured, in_error):
    assert limited(measured).objective_status(SEARCH) == ("IN_ERROR_FR" if in_error else None)


@AROUND_THE_LIMIT
def test_more_than_the_objective_requires_is_in_the_designs_error_log(limited, measured, in_error):
    logged = limited(measured).values("fd_spiral_low", "fd_error_log")
    assert logged == (("o_generate_search_path",) if in_error else ())


@pytest.mark.parametrize("kind", ["COMPONENT", "NFR", "FR"])
def test_an_error_of_a_grounding_becomes_its_objectives_error(suave_copy, kind):
    path = suave_copy(rule("inject", f'FunctionGrounding(?g) -> fg_status(?g, "IN_ERROR_{kind}")'))
    inference = with_files(path).analyze(searching("fd_spiral_low"))
    assert inference.objective_status(SEARCH) == f"IN_ERROR_{kind}"


@pytest.mark.parametrize("kind", ["COMPONENT", "NFR", "FR"])
def test_an_objectives_error_reaches_the_grounding_that_requires_it(suave_copy, kind):
    path = suave_copy(
        individual("fg_spiral_low", "FunctionGrounding", ("requiresO", ":o_maintain_motion"))
    )
    state = KnowledgeState.of(
        [ObjectiveState(SEARCH), ObjectiveState(MOTION, f"IN_ERROR_{kind}")],
        groundings={SEARCH: "fd_spiral_low"},
    )
    inference = with_files(path).analyze(state)
    assert inference.grounding_status(SEARCH) == f"IN_ERROR_{kind}"
    assert inference.objective_status(SEARCH) == f"IN_ERROR_{kind}"


def bound_thruster(status: str) -> str:
    """A role of fd_spiral_low that a component in status takes, and whose specification has a
    unique class.
    """
    return (
        individual("cc_camera", "ComponentClass", ("cc_unique", "true"))
        + individual("cs_camera", "ComponentSpecification", ("typeC", ":cc_camera"))
        + individual("r_camera", "Role", ("roleDef", ":cs_camera"))
        + individual(
            "c_camera",
            "Component",
            ("typeC", ":cc_camera"),
            *([("c_status", status)] if status else []),
        )
        + individual(
            "b_camera", "Binding", ("binding_component", ":c_camera"), ("binding_role", ":r_camera")
        )
        + individual("fg_spiral_low", "FunctionGrounding", ("hasBindings", ":b_camera"))
        + individual("fd_spiral_low", "FunctionDesign", ("roles", ":r_camera"))
    )


def test_what_follows_from_the_boolean_status_of_older_models(suave_copy):
    reasoner = with_files(suave_copy(bound_thruster("false")))
    assert inferred(reasoner, searching("fd_spiral_low")) == {
        "b_status(b_camera, false)",  # S2
        "fg_status(fg_spiral_low, IN_ERROR_COMPONENT)",  # S3
        "o_status(o_generate_search_path, IN_ERROR_COMPONENT)",  # S1a
        "cspec_availability(cs_camera, false)",  # S10
        "cc_availability(cc_camera, false)",  # S4
        "fd_realisability(fd_spiral_low, false)",  # S5, S11
    }


def test_the_reported_status_makes_the_class_unavailable_but_not_the_binding(suave_copy):
    reasoner = with_files(suave_copy(bound_thruster("")))
    state = searching("fd_spiral_low", components={"c_camera": "FALSE"})
    assert inferred(reasoner, state) == {
        "cc_availability(cc_camera, false)",  # mros_S4
        "fd_realisability(fd_spiral_low, false)",  # S5
    }


def test_an_unavailable_specification_makes_the_design_unrealisable(suave_copy):
    path = suave_copy(
        individual("cs_camera", "ComponentSpecification", ("cspec_availability", "false"))
        + individual("r_camera", "Role", ("roleDef", ":cs_camera"))
        + individual("fd_spiral_low", "FunctionDesign", ("roles", ":r_camera"))
    )
    assert inferred(with_files(path), searching()) == {"fd_realisability(fd_spiral_low, false)"}


def test_a_status_in_the_ontology_holds_until_diagnostics_report_another(suave_copy):
    reasoner = with_files(
        suave_copy(individual("c_thruster_1", "Component", ("c_status", "FALSE")))
    )
    assert inferred(reasoner, searching()) == {"fd_realisability(fd_all_thrusters, false)"}
    assert inferred(reasoner, searching(components={"c_thruster_1": "OK"})) == set()


@pytest.mark.parametrize("name", ["pellet", "owlready2"])
def test_a_disabled_rule_does_not_fire(suave_copy, name):
    path = suave_copy(
        replace={'#boolean">true</swrla:isRuleEnabled>': '#boolean">false</swrla:isRuleEnabled>'}
    )
    base = Ontology.load([path])
    assert [rule.name for rule in base.rules if not rule.enabled] == ["QAWaterVisibility"]
    assert Reasoner(base, name).analyze(searching("fd_spiral_high", 1.0)).facts == frozenset()


def _clash(suave_copy: MakeOntology) -> Path:
    return suave_copy(
        rule(
            "alarm",
            'FunctionGrounding(?g) ^ typeFD(?g, :fd_spiral_high) -> fg_status(?g, "IN_ERROR_FR")',
        )
    )


def clash(reasoner: Reasoner) -> str:
    """What is told of a state in which two rules contradict each other."""
    with pytest.raises(KnowledgeError) as error:
        reasoner.analyze(searching("fd_spiral_high", 3.0))
    return str(error.value)


@pytest.mark.parametrize("name", ["pellet", "owlready2"])
def test_clashing_rules_are_named_with_what_they_clash_on(suave_copy, name):
    message = clash(Reasoner(Ontology.load([_clash(suave_copy)]), name))
    for part in (
        "fg_spiral_high",
        "fg_status",
        "alarm",
        "QAWaterVisibility",
        "hasValue(obs_water_visibility, 3)",
    ):
        assert part in message
    assert "\n" not in message


def test_a_contradiction_leaves_no_trace_in_the_next_state(suave_copy):
    reasoner = with_files(_clash(suave_copy))
    clash(reasoner)
    later = reasoner.analyze(searching("fd_spiral_high", 4.0))
    assert later.grounding_status(SEARCH) == "IN_ERROR_FR"


def test_every_kind_of_conclusion_of_an_own_rule_is_read(suave_copy):
    rules: Mapping[str, str] = {
        "number": "QAvalue(?q) ^ hasValue(?q, ?v) ^ isQAtype(?q, :water_visibility) ^ multiply(?w, ?v, 2.0)"
        " -> tomasys:doubled(?q, ?w)",
        "text": 'Component(?c) ^ c_status(?c, "FALSE") -> '
        'tomasys:note(?c, "it\'s 50% (no), été 🚨 C:\\new\\U0001F6A8")',
        "thing": 'Component(?c) ^ c_status(?c, "FALSE") ^ Objective(?o) -> tomasys:hinders(?c, ?o)',
        "kind": 'Component(?c) ^ c_status(?c, "FALSE") -> tomasys:Broken(?c)',
    }
    data = {"tomasys:doubled", "tomasys:note"}
    extra = "".join(rule(name, text, data=data) for name, text in rules.items())
    base = Ontology.load([suave_copy(extra)])
    state = searching(None, 1.7, components={"c_thruster_2": "FALSE"})
    inference = Reasoner(base, "pellet").analyze(state)
    found = {str(fact) for fact in inference.facts}
    assert Fact("obs_water_visibility", "doubled", Decimal("3.4")) in inference.facts
    assert "note(c_thruster_2, it's 50% (no), été 🚨 C:\\new\\U0001F6A8)" in found
    assert "hinders(c_thruster_2, o_generate_search_path)" in found
    assert "Broken(c_thruster_2)" in found
    assert Reasoner(base, "owlready2").analyze(state).facts ^ inference.facts == frozenset()


@pytest.mark.parametrize(
    ("mark", "fires"),
    [("true", True), ("1", True), ("false", False), ("0", False), (" False\n", False)],
)
def test_a_rule_runs_unless_its_mark_says_false_in_any_form(suave_copy, mark, fires):
    old = '#boolean">true</swrla:isRuleEnabled>'
    path = suave_copy(replace={old: f'#boolean">{mark}</swrla:isRuleEnabled>'})
    inference = with_files(path).analyze(searching("fd_spiral_high", 1.0))
    assert inference.grounding_status(SEARCH) == ("IN_ERROR_NFR" if fires else None)


def test_a_rule_without_a_mark_runs(suave_copy):
    text = rule("own", 'FunctionGrounding(?g) -> fg_status(?g, "IN_ERROR_FR")')
    path = suave_copy(re.sub("<swrla:isRuleEnabled.*?</swrla:isRuleEnabled>", "", text))
    inference = with_files(path).analyze(searching("fd_spiral_low"))
    assert inference.grounding_status(SEARCH) == "IN_ERROR_FR"


def test_rules_of_a_given_mros_ontology_take_the_place_of_the_shipped_copy(shipped, tmp_path):
    own = rule("mros_S4", "Component(?c) -> Role(?c)")
    path = tmp_path / "mros.owl"
    path.write_text(
        f'<rdf:RDF xmlns:rdf="{RDF}" xmlns:rdfs="{RDFS}" xmlns:owl="{OWL}" xmlns:swrl="{SWRL}" '
        f'xmlns:swrla="{SWRLA}"><owl:Ontology rdf:about="http://ros/mros"/>{own}</rdf:RDF>',
        encoding="utf-8",
    )
    base = Ontology.load([shipped / "suave.owl", path])
    texts = [rule.text for rule in base.rules if rule.name == "mros_S4"]
    assert texts == ["Component(?c) -> Role(?c)"]
    assert base.files == tuple(sorted((path, shipped / "suave.owl", shipped / "tomasys.owl")))
