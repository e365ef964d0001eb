"""The loop's semantics: which objectives are adapted, which designs are left out and why, which one
is chosen.
"""

from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import QA_OPERATOR, Lit
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import Decision, KnowledgeState, ObjectiveState
from tests.helpers.checks import subject
from tests.helpers.knowledge_states import MOTION, SEARCH, searching
from tests.helpers.owl_text import individual


def decide(reasoner: Reasoner, state: KnowledgeState, **options: bool) -> dict[str, Decision]:
    decisions = reasoner.plan(reasoner.analyze(state), **options).decisions
    assert [d.function for d in decisions] == sorted(d.function for d in decisions)
    return {decision.function: decision for decision in decisions}


def decide_with(file: Path, state: KnowledgeState) -> Decision:
    return decide(Reasoner(Ontology.load([file]), "pellet"), state)[SEARCH]


@pytest.mark.parametrize(
    ("visibility", "design"),
    [(None, "fd_spiral_high"), (3.25, "fd_spiral_high"), (2.25, "fd_spiral_medium"), (1.0, None)],
)
def test_an_ungrounded_search_gets_the_highest_altitude_that_visibility_allows(
    kb, pellet, visibility, design
):
    decision = decide(pellet, searching(None, visibility, status="UNGROUNDED"))[SEARCH]
    assert decision.design == design


def test_each_design_left_out_has_its_numbers(kb, pellet):
    decision = decide(pellet, searching("fd_spiral_high", 1.8))[SEARCH]
    assert decision.design == "fd_spiral_low"
    assert [(rejection.design, rejection.reason) for rejection in decision.rejected] == [
        ("fd_spiral_high", "water_visibility 1.80 measured < 3.25 expected"),
        ("fd_spiral_medium", "water_visibility 1.80 measured < 2.25 expected"),
    ]
    assert (
        decision.reason
        == "o_status IN_ERROR_NFR: highest performance (0.25) among 1 eligible of 3 designs"
    )


def since(reasoner: Reasoner, state: KnowledgeState, visibility: str) -> tuple[Decision, ...]:
    """Decide with a visibility that is measured after the inference."""
    later = replace(state, measured_since=(("water_visibility", Decimal(visibility)),))
    return reasoner.analyze_and_plan(later).plan.decisions


def test_a_design_is_chosen_by_what_has_been_measured_since_the_inference(kb, pellet):
    (decision,) = since(pellet, searching("fd_spiral_high", 1.8), "2.3")
    assert decision.design == "fd_spiral_medium"
    assert decision.reason.startswith("o_status IN_ERROR_NFR")
    assert decision.reason.endswith(", with water_visibility 2.30 (1.80 when inferred)")


def test_whether_to_adapt_does_not_depend_on_what_has_been_measured_since(kb, pellet):
    assert since(pellet, searching("fd_spiral_medium", 2.5), "1.0") == ()


def test_numbers_that_look_alike_are_shown_with_more_digits(kb, pellet):
    decision = decide(pellet, searching("fd_spiral_medium", "2.2499999"))[SEARCH]
    assert "water_visibility 2.2499999 measured < 2.25 expected" in [
        r.reason for r in decision.rejected
    ]


def test_with_no_design_left_the_present_one_is_kept(kb, pellet):
    decision = decide(pellet, searching("fd_spiral_low", 1.0))[SEARCH]
    assert decision.design is None
    assert len(decision.rejected) == 3


def test_that_no_design_is_left_is_the_reason_for_keeping_the_present_one(kb, pellet):
    decision = decide(pellet, searching("fd_spiral_low", 1.0))[SEARCH]
    said = "o_status IN_ERROR_NFR: no function design is left, fd_spiral_low is kept"
    assert decision.reason == said


def test_an_objective_is_adapted_when_it_is_exceeded(kb, pellet):
    exceeded = decide(pellet, searching("fd_spiral_low", 3.5), improve_exceeded=True)[SEARCH]
    assert exceeded.design == "fd_spiral_high"
    assert exceeded.reason.startswith("water_visibility 3.50 exceeds what fd_spiral_low expects")


def test_an_objective_that_is_just_met_is_not_exceeded(kb, pellet):
    assert decide(pellet, searching("fd_spiral_low", 1.25), improve_exceeded=True) == {}


def test_an_objective_that_is_always_to_be_improved_is_adapted(kb, pellet):
    always = decide(pellet, searching("fd_spiral_low", 3.5, always_improve=True))
    assert always[SEARCH].design == "fd_spiral_high"


@pytest.mark.parametrize(
    "status", ["UNGROUNDED", "IN_ERROR_FR", "IN_ERROR_COMPONENT", "IN_ERROR_NFR", "UPDATABLE"]
)
def test_statuses_that_call_for_adaptation(kb, pellet, status):
    design = "fd_spiral_low" if status == "UPDATABLE" else None  # as older models have it
    assert SEARCH in decide(pellet, searching(design, 3.5, status=status))


FAILED = {"c_thruster_1": "FALSE"}
RECOVERED = {"c_thruster_1": "RECOVERED"}


def with_thrusters(reasoner: Reasoner, motion: str, components: dict[str, str]):
    state = searching("fd_spiral_high", 3.5, motion=motion, components=components)
    return decide(reasoner, state)


def test_a_failed_thruster_is_recovered(kb, pellet):
    decisions = with_thrusters(pellet, "fd_all_thrusters", FAILED)
    assert set(decisions) == {MOTION}
    assert decisions[MOTION].design == "fd_recover_thrusters"
    assert decisions[MOTION].rejected[0].reason == "not realisable"


def test_while_a_thruster_is_being_recovered_nothing_is_adapted(kb, pellet):
    assert with_thrusters(pellet, "fd_recover_thrusters", FAILED) == {}


def test_after_a_recovery_all_thrusters_are_used(kb, pellet):
    motion = with_thrusters(pellet, "fd_recover_thrusters", RECOVERED)[MOTION]
    assert motion.design == "fd_all_thrusters"
    assert motion.reason.startswith("updatable")


def test_a_recovery_leaves_the_best_design_of_other_functions_in_use(kb, pellet):
    decisions = with_thrusters(pellet, "fd_recover_thrusters", RECOVERED)
    assert decisions[SEARCH].design == "fd_spiral_high"


def test_a_recovery_makes_nothing_realisable_while_another_thruster_has_failed(kb, pellet):
    both = {**RECOVERED, "c_thruster_2": "FALSE"}
    motion = with_thrusters(pellet, "fd_recover_thrusters", both)[MOTION]
    assert motion.design == "fd_recover_thrusters"


def test_a_design_in_the_error_log_is_left_out(suave_copy):
    path = suave_copy(
        individual("fd_spiral_high", "FunctionDesign", ("fd_error_log", ":o_generate_search_path"))
    )
    decision = decide_with(path, searching(None, 3.5, status="UNGROUNDED"))
    assert decision.design == "fd_spiral_medium"
    assert decision.rejected[0].reason == "o_generate_search_path is in its error log"


def test_a_value_that_the_objective_requires_is_compared_with_the_expected_one(suave_copy):
    path = suave_copy(
        individual("nfr", "QAvalue", ("isQAtype", ":mros:energy"), ("hasValue", "0.6"))
        + individual("o_generate_search_path", "Objective", ("hasNFR", ":nfr"))
        + individual("qa_energy_high", "QAvalue", ("isQAtype", ":mros:energy"), ("hasValue", "0.9"))
        + individual("fd_spiral_high", "FunctionDesign", ("hasQAestimation", ":qa_energy_high"))
        + individual(
            "qa_energy_medium", "QAvalue", ("isQAtype", ":mros:energy"), ("hasValue", "0.6")
        )
        + individual("fd_spiral_medium", "FunctionDesign", ("hasQAestimation", ":qa_energy_medium"))
    )
    decision = decide_with(path, searching(None, 3.5, status="UNGROUNDED"))
    assert decision.design == "fd_spiral_medium"
    assert [r.reason for r in decision.rejected] == ["energy 0.90 expected > 0.60 required"]


def test_a_value_is_bad_if_any_operator_of_its_attribute_says_so(suave_copy):
    """The schema allows one operator; without that, expected and measured values are compared by
    each.
    """
    designs = {"fd_spiral_low": "0.5", "fd_spiral_medium": "0.6", "fd_spiral_high": "0.7"}
    added = individual(
        "current", "QualityAttributeType", ("qa_comparison_operator", "<")
    ) + "".join(
        individual(f"qa_{name}", "QAvalue", ("isQAtype", ":current"), ("hasValue", value))
        + individual(name, "FunctionDesign", ("hasQAestimation", f":qa_{name}"))
        for name, value in designs.items()
    )
    required = individual("nfr", "QAvalue", ("isQAtype", ":current"), ("hasValue", "0.6"))
    required += individual("o_generate_search_path", "Objective", ("hasNFR", ":nfr"))

    def decided(text: str, state: KnowledgeState) -> Decision:
        base = Ontology.load([suave_copy(text)])
        facts = [
            each
            for each in base.content.triples
            if not (each[0] == QA_OPERATOR and "Functional" in str(each[2]))
        ]
        current = next(
            each for each in facts if each[1] == QA_OPERATOR and each[0].endswith("#current")
        )
        content = replace(
            base.content, triples=(*facts, (*current[:2], Lit(">", current[2].datatype)))
        )
        return decide(Reasoner(replace(base, content=content), "pellet"), state)[SEARCH]

    decision = decided(added + required, searching(None, None, status="UNGROUNDED"))
    assert decision.design == "fd_spiral_medium"
    assert {(r.design, r.reason) for r in decision.rejected} == {
        ("fd_spiral_low", "current 0.50 expected < 0.60 required"),
        ("fd_spiral_high", "current 0.70 expected > 0.60 required"),
    }
    measured = decided(
        added,
        KnowledgeState.of([ObjectiveState(SEARCH, "UNGROUNDED")], measurements={"current": 0.6}),
    )
    assert measured.design == "fd_spiral_medium"
    assert {r.reason for r in measured.rejected} == {
        "current 0.60 measured > 0.50 expected",
        "current 0.60 measured < 0.70 expected",
    }


def test_a_required_performance_counts_designs_that_tell_none_as_bad(suave_copy):
    path = suave_copy(
        individual("nfr", "QAvalue", ("isQAtype", ":mros:performance"), ("hasValue", "0.5"))
        + individual("o_generate_search_path", "Objective", ("hasNFR", ":nfr"))
        + individual("fd_drift", "FunctionDesign", ("solvesF", ":f_generate_search_path"))
    )
    decision = decide_with(path, searching(None, 2.5, status="UNGROUNDED"))
    assert decision.design == "fd_spiral_medium"
    assert {r.design for r in decision.rejected} == {"fd_drift", "fd_spiral_low", "fd_spiral_high"}


@pytest.mark.parametrize(
    ("operator", "allowed"), [("<", [0.5, 0.6]), ("<=", [0.6]), (">", [0.4, 0.5]), (">=", [0.4])]
)
def test_the_operator_of_the_attribute_decides_what_is_bad(suave_copy, operator, allowed):
    path = suave_copy(
        individual("current", "QualityAttributeType", ("qa_comparison_operator", operator))
        + individual("qa_current", "QAvalue", ("isQAtype", ":current"), ("hasValue", "0.5"))
        + individual("fd_spiral_high", "FunctionDesign", ("hasQAestimation", ":qa_current"))
    )
    base = Ontology.load([path])
    reasoner = Reasoner(base, "pellet")

    def chosen(current: float) -> str | None:
        state = KnowledgeState.of(
            [ObjectiveState(SEARCH, "UNGROUNDED")], measurements={"current": current}
        )
        return decide(reasoner, state)[SEARCH].design

    assert [value for value in (0.4, 0.5, 0.6) if chosen(value) == "fd_spiral_high"] == allowed


SILENT = individual("fd_a", "FunctionDesign", ("solvesF", ":f_generate_search_path"))
"""A design of which no performance is expected."""


@pytest.mark.parametrize(("visibility", "design"), [(2.5, "fd_spiral_medium"), (0.5, "fd_a")])
def test_a_design_without_performance_counts_less_than_any_other(
    with_a_silent_design, visibility, design
):
    state = searching(None, visibility, status="UNGROUNDED")
    assert decide(with_a_silent_design, state)[SEARCH].design == design


@pytest.fixture(scope="module")
def with_a_silent_design(tmp_path_factory: pytest.TempPathFactory) -> Reasoner:
    given = subject(tmp_path_factory.mktemp("silent"), extra=SILENT)
    return Reasoner(Ontology.load(given.ontologies), "pellet")


def test_of_equally_good_designs_the_first_by_name_is_chosen(suave_copy):
    path = suave_copy(
        SILENT + individual("fd_0", "FunctionDesign", ("solvesF", ":f_generate_search_path"))
    )
    assert decide_with(path, searching(None, 0.5, status="UNGROUNDED")).design == "fd_0"


@pytest.fixture(scope="module")
def overridden() -> Ontology:
    values = {"qa_water_visibility_high": Decimal(2), "qa_water_visibility_medium": Decimal(1)}
    return Ontology.load(values=values)


def test_an_overridden_value_is_what_is_expected_of_the_design(overridden):
    assert overridden.expected("fd_spiral_high")["water_visibility"] == 2


def test_an_overridden_value_decides(overridden):
    state = searching(None, 2.0, status="UNGROUNDED")
    assert decide(Reasoner(overridden, "pellet"), state)[SEARCH].design == "fd_spiral_high"


def test_overridden_values_show_in_the_hash(kb, overridden):
    assert overridden.content_hash != kb.content_hash


def test_what_monitors_report_beyond_the_model_has_no_effect(pellet):
    state = KnowledgeState.of(
        [ObjectiveState(SEARCH)], components={"c_sonar": "FALSE"}, measurements={"salinity": 35.0}
    )
    assert pellet.analyze(state).facts == frozenset()


SEVERAL_VALUES = (
    individual("qa_p", "QAvalue", ("isQAtype", ":mros:performance"), ("hasValue", "0.9"))
    + individual("qa_v", "QAvalue", ("isQAtype", ":water_visibility"), ("hasValue", "4.5"))
    + individual("qa_none", "QAvalue", ("isQAtype", ":water_visibility"))
    + individual(
        "fd_spiral_low",
        "FunctionDesign",
        *(("hasQAestimation", f":{name}") for name in ("qa_p", "qa_v", "qa_none")),
    )
)
"""A performance of 0.9 for fd_spiral_low beside that of 0.25, and a visibility beside 1.25 m."""


def test_of_several_expected_values_the_least_counts(suave_copy):
    base = Ontology.load([suave_copy(SEVERAL_VALUES)])
    assert base.expected("fd_spiral_low")["water_visibility"] == Decimal("1.25")


@pytest.mark.parametrize(
    ("performance_high", "design"), [("1.0", "fd_spiral_high"), ("0.8", "fd_spiral_low")]
)
def test_of_several_performances_the_best_counts(suave_copy, performance_high, design):
    """As the exemplar's loop takes the highest performance among the estimations of a design."""
    values = {"qa_performance_high": Decimal(performance_high)}
    base = Ontology.load([suave_copy(SEVERAL_VALUES)], values=values)
    state = searching(None, 9, status="UNGROUNDED")
    assert decide(Reasoner(base, "pellet"), state)[SEARCH].design == design
