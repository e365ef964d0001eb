"""Whatever stands in a state or in a test of rules is used, or refused with its place."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.errors import InputError
from suave_des.kb.rule_tests import TestFile, run_test
from suave_des.kb.states import StateBuilder
from suave_des.knowledge.state import KnowledgeState, ObjectiveState

#: Scalars of YAML that JSON does not have, and numbers that no measurement is.
SCALARS = (".nan .inf -.inf ~ 0x10 1e400 -1e-400 2023-01-01 FALSE 'it''s' " + "9" * 500).split()
#: Text with halves of surrogate pairs, which JSON and YAML can write as escapes.
TEXTS = st.text(st.characters(codec=None, categories=["Ll", "Nd", "Cs", "Cc", "Zs"]), max_size=6)
PLAIN = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(-1e9, 1e9), TEXTS)
VALUES = st.recursive(
    PLAIN,
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(TEXTS, inner, max_size=2),
    max_leaves=4,
).map(json.dumps) | st.sampled_from(SCALARS)

#: Where a value can stand in a state.
IN_STATES = (
    "objectives: VALUE",
    "objectives: {f_maintain_motion: VALUE}",
    "groundings: {f_maintain_motion: VALUE}",
    "components: {c_thruster_1: VALUE}",
    "measurements: {water_visibility: VALUE}",
)
#: Where a value can stand in a test.
IN_TESTS = (
    *(f"given: {{{place}}}, follows: [Component(c_thruster_1)]" for place in IN_STATES),
    "given: {facts: [VALUE]}, follows: [Component(c_thruster_1)]",
    "given: {mission: VALUE, at_s: VALUE}, follows: [Component(c_thruster_1)]",
    "follows: [VALUE]",
    "follows_not: [VALUE]",
    "decides: {f_maintain_motion: VALUE}",
)


@settings(max_examples=30, deadline=None)
@given(place=st.sampled_from(IN_STATES), value=VALUES)
def test_a_state_with_any_value_is_inferred_from_or_refused(
    tmp_path_factory, knowledge, place, value
):
    path = tmp_path_factory.getbasetemp() / "state.yaml"
    path.write_text(place.replace("VALUE", value) + "\n", encoding="utf-8")
    builder = StateBuilder(knowledge.base, knowledge.settings)
    try:
        builder.add_file(path)
    except InputError as error:
        assert error.file == str(path)
        assert error.place is not None
        return
    try:
        assert str(knowledge.explain(builder.state()))
    except InputError as error:  # two statuses
        assert error.problem.startswith("contradiction")


@settings(max_examples=60, deadline=None)
@given(place=st.sampled_from(IN_TESTS), value=VALUES)
def test_a_test_of_rules_with_any_value_is_run_or_refused(
    tmp_path_factory, knowledge, place, value
):
    path = tmp_path_factory.getbasetemp() / "tests.yaml"
    path.write_text(f"tests: [{{name: any, {place.replace('VALUE', value)}}}]\n", encoding="utf-8")
    try:
        (test,) = TestFile.read(path).tests(knowledge)
    except InputError as error:
        assert error.file == str(path)
        assert error.place is not None
        return
    assert run_test(knowledge, test).test is test


@pytest.mark.parametrize("status", ["\ud800", b"FALSE", ["FALSE"], 3, float("nan")], ids=ascii)
@pytest.mark.parametrize(
    "parts",
    [
        lambda status: {"components": {"c_thruster_1": status}},
        lambda status: {"objectives": [ObjectiveState("c_thruster_1", status)]},
        lambda status: {"groundings": {"c_thruster_1": status}},
    ],
    ids=["component", "objective", "grounding"],
)
def test_a_state_takes_text_alone(parts, status):
    with pytest.raises(InputError, match="c_thruster_1: "):
        KnowledgeState.of(**parts(status))
