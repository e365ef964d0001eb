"""kb explain: derivations hold in Pellet step by step, decisions name the filter, contradictions
name the rules.
"""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.errors import InputError, KnowledgeError
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.knowledge.state import KnowledgeState
from tests.helpers.checks import subject

MOTION, SEARCH = "f_maintain_motion", "f_generate_search_path"
CLASH = (
    "clash: FunctionGrounding(?fg) ^ hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ "
    'lessThan(?v, 2) -> fg_status(?fg, "IN_ERROR_FR")\n'
)


@pytest.fixture(scope="module")
def in_error(knowledge):
    return knowledge.state(
        groundings={SEARCH: "fd_spiral_high", MOTION: "fd_all_thrusters"},
        components={"c_thruster_1": "FALSE"},
        measurements={"water_visibility": 1.8},
    )


def nodes(derivation):
    yield derivation
    for premise in derivation.premises:
        yield from nodes(premise)


@settings(max_examples=15)
@given(
    search=st.sampled_from(["fd_spiral_low", "fd_spiral_medium", "fd_spiral_high"]),
    motion=st.sampled_from(["fd_all_thrusters", "fd_recover_thrusters"]),
    statuses=st.lists(st.sampled_from(["FALSE", "RECOVERED"]), max_size=2),
    visibility=st.sampled_from(["1", "1.25", "1.2500001", "2.25", "3", "4"]),
)
def test_every_inferred_fact_has_a_tree_down_to_asserted_facts(
    knowledge, search, motion, statuses, visibility
):
    state = knowledge.state(
        groundings={SEARCH: search, MOTION: motion},
        components={f"c_thruster_{n}": status for n, status in enumerate(statuses, start=1)},
        measurements={"water_visibility": visibility},
    )
    inference = knowledge.infer(state).inference
    rules = {rule.name: rule for rule in knowledge.base.rules}
    derived = knowledge.explain(state).facts
    assert {each.fact for each in derived} == inference.facts
    for node in (node for each in derived for node in nodes(each)):
        assert node.fact in inference.facts | inference.asserted
        if node.source == "rule":
            body = rules[node.rule].body
            assert {name for name, _ in node.bindings} == {
                name for atom in body for name in atom.variables()
            }
            assert len(node.premises) == sum(
                atom.kind in ("class", "object", "data") for atom in body
            )
        else:
            assert node.fact in inference.asserted
            assert not node.premises


def test_a_chain_of_rules_is_told_with_its_bindings(knowledge, in_error):
    (tree,) = knowledge.explain(in_error, f"o_status(o_{SEARCH[2:]}, IN_ERROR_NFR)").facts
    assert (tree.rule, tree.rules()) == ("S1b", {"S1b", "QAWaterVisibility"})
    error = next(each for each in tree.premises if each.source == "rule")
    assert {("expected", "3.25"), ("measured", "1.8")} <= {
        (name, str(value)) for name, value in error.bindings
    }


def test_a_fact_that_the_schema_adds_names_it(suave_copy):
    # Nothing says that c_new is a Component but the domain of requiredBy.
    new = (
        '<rdf:Description rdf:about="http://www.metacontrol.org/suave#c_new">'
        '<mros:requiredBy rdf:resource="http://www.metacontrol.org/suave#fd_spiral_low"/></rdf:Description>'
    )
    knowledge = KnowledgeBase.load(suave_copy(new))
    state = knowledge.state(components={"c_new": "FALSE"})
    (tree,) = knowledge.explain(state, "fd_realisability(fd_spiral_low, false)").facts
    assert tree.rule == "compError"
    kind = next(each for each in tree.premises if each.fact.property == "type")
    assert (kind.source, str(kind.fact)) == ("axioms", "Component(c_new)")
    assert {each.source for each in kind.premises} <= {"state", "ontology"}


def test_a_design_may_have_any_name(suave_copy):
    name = "fd_d'or_\N{OCTOPUS}"
    knowledge = KnowledgeBase.load(suave_copy(replace={"fd_spiral_high": name}))
    (decision,) = knowledge.explain(knowledge.state(), f"why {name}?").decisions
    assert f"{name} is chosen" in decision[0]


def test_of_several_derivations_the_first_is_told_whatever_pellet_picks(tmp_path):
    rules = tmp_path / "any.swrl"
    rules.write_text(
        "any: isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ lessThan(?v, 9) -> "
        "fd_realisability(fd_spiral_high, false)\n"
    )
    knowledge = KnowledgeBase.load(rules=[rules])
    trees = [
        knowledge.explain(knowledge.state(), "fd_realisability(fd_spiral_high, false)").facts[0]
        for _ in range(3)
    ]
    assert len(set(trees)) == 1
    assert dict(trees[0].bindings)["q"] == "qa_water_visibility_high"


@pytest.fixture(scope="module")
def left_out(knowledge, in_error) -> tuple[str, ...]:
    (decision,) = knowledge.explain(in_error, "why not fd_all_thrusters?").decisions
    return decision


@pytest.fixture(scope="module")
def chosen(knowledge, in_error) -> tuple[str, ...]:
    (decision,) = knowledge.explain(in_error, "why fd_spiral_low?").decisions
    return decision


class TestDecisions:
    def test_why_not_names_the_filter(self, left_out):
        assert left_out[0] == "f_maintain_motion: fd_all_thrusters is left out: not realisable"

    def test_why_not_tells_how_the_fact_of_the_filter_follows(self, left_out):
        at = left_out.index("  fd_all_thrusters: left out: not realisable")
        assert "[by rule compError with " in left_out[at + 1]

    def test_why_tells_what_called_for_the_decision(self, chosen):
        assert chosen[1] == "  adapted because"
        assert "[by rule S1b with " in chosen[2]

    def test_why_tells_what_became_of_each_design(self, chosen):
        assert [line.split(": ")[:2] for line in chosen if line.startswith("  fd_")] == [
            ["  fd_spiral_high", "left out"],
            ["  fd_spiral_low", "chosen"],
            ["  fd_spiral_medium", "left out"],
        ]

    def test_a_design_that_is_merely_worse_is_compared_with_the_best(self, knowledge):
        (decision,) = knowledge.explain(knowledge.state(), "why not fd_spiral_low?").decisions
        assert decision[0].endswith(
            ": fd_spiral_low is not the best: performance 0.25 < 1.0 of fd_spiral_high"
        )

    def test_nothing_to_adapt_is_said(self, knowledge):
        state = knowledge.state(
            groundings={SEARCH: "fd_spiral_low"}, measurements={"water_visibility": 1.25}
        )
        (decision,) = knowledge.explain(state, "why not fd_spiral_high?").decisions
        assert "requires no adaptation, so fd_spiral_low stays" in decision[0]
        (decision,) = knowledge.explain(state, "why fd_recover_thrusters?").decisions
        assert "f_maintain_motion has no objective in this state" in decision[0]

    def test_with_no_design_left_the_present_one_stays(self, knowledge):
        state = knowledge.state(
            groundings={SEARCH: "fd_spiral_low"}, measurements={"water_visibility": 1}
        )
        (decision,) = knowledge.explain(state, "why not fd_spiral_high?").decisions
        assert (
            ": no design is left, fd_spiral_low stays; fd_spiral_high is left out: " in decision[0]
        )


def test_of_what_does_not_hold_that_is_told_which_no_state_can_make_hold(knowledge):
    """No thruster is required by fd_spiral_high: whether one has failed does not matter."""
    with pytest.raises(
        InputError, match=r"rule compError: requiredBy\(\?c, \?fd\) does not hold: found requiredBy"
    ):
        knowledge.explain(knowledge.state(), "fd_realisability(fd_spiral_high, false)")


def test_a_fact_that_does_not_follow_names_the_rule_that_comes_nearest(knowledge, command):
    clear = ("--at", "water_visibility=3.5", "--at", f"{SEARCH}=fd_spiral_high")
    status, _, error = command("explain", "fg_status(fg_spiral_high, IN_ERROR_NFR)", *clear)
    assert (status, error.count("\n")) == (2, 1)
    assert (
        "does not follow in this state (fg_status of fg_spiral_high: none; rule QAWaterVisibility: lessThan("
        in error
    )
    assert "does not hold: found 3.5 (?measured), needed less than 3.25" in error


@pytest.fixture(scope="module")
def clashing(tmp_path_factory: pytest.TempPathFactory) -> KnowledgeBase:
    rules = tmp_path_factory.mktemp("clash") / "clash.swrl"
    rules.write_text(CLASH)
    return KnowledgeBase.load(rules=[rules])


def measured(knowledge: KnowledgeBase, visibility: float) -> KnowledgeState:
    return knowledge.state(
        groundings={SEARCH: "fd_spiral_high"}, measurements={"water_visibility": visibility}
    )


def test_a_contradiction_names_the_rules(clashing):
    with pytest.raises(KnowledgeError, match=r"by the rules QAWaterVisibility \(.*, clash \("):
        clashing.explain(measured(clashing, 1.8))


def test_a_state_in_which_rules_do_not_clash_is_explained(clashing):
    assert clashing.explain(measured(clashing, 2)).facts


SCHEMA = """
<owl:Class rdf:about="http://www.metacontrol.org/suave#FailedComponent"><owl:equivalentClass><owl:Restriction>
  <owl:onProperty rdf:resource="http://metacontrol.org/tomasys#c_status"/><owl:hasValue>FALSE</owl:hasValue>
</owl:Restriction></owl:equivalentClass></owl:Class>
<owl:TransitiveProperty rdf:about="http://www.metacontrol.org/suave#partOf">
  <rdf:type rdf:resource="http://www.w3.org/2002/07/owl#ObjectProperty"/>
</owl:TransitiveProperty>
<owl:ObjectProperty rdf:about="http://www.metacontrol.org/suave#hasPart">
  <owl:inverseOf rdf:resource="http://www.metacontrol.org/suave#partOf"/>
</owl:ObjectProperty>
<owl:NamedIndividual rdf:about="http://www.metacontrol.org/suave#motor">
  <partOf xmlns="http://www.metacontrol.org/suave#" rdf:resource="http://www.metacontrol.org/suave#c_thruster_1"/>
</owl:NamedIndividual>
<rdf:Description rdf:about="http://www.metacontrol.org/suave#c_thruster_1">
  <partOf xmlns="http://www.metacontrol.org/suave#" rdf:resource="http://www.metacontrol.org/suave#hull"/>
</rdf:Description>
<owl:NamedIndividual rdf:about="http://www.metacontrol.org/suave#hull"/>
"""


CONCLUDED = ["FailedComponent(c_thruster_3)", "partOf(motor, hull)", "hasPart(hull, motor)"]


@pytest.fixture(scope="module")
def by_axioms(tmp_path_factory: pytest.TempPathFactory) -> tuple[KnowledgeBase, KnowledgeState]:
    """A knowledge base in which axioms conclude something, and a state for it."""
    given = subject(tmp_path_factory.mktemp("axioms"), extra=SCHEMA)
    knowledge = KnowledgeBase.load(given.ontologies)
    return knowledge, knowledge.state(components={"c_thruster_3": "FALSE"})


def test_what_axioms_conclude_is_inferred(by_axioms):
    knowledge, state = by_axioms
    assert set(map(str, knowledge.infer(state).inference.facts)).issuperset(CONCLUDED)


@pytest.mark.parametrize("fact", CONCLUDED)
def test_what_axioms_conclude_is_explained(by_axioms, fact):
    knowledge, state = by_axioms
    (derivation,) = knowledge.explain(state, fact).facts
    assert derivation.source == "axioms"
    assert derivation.axioms


def test_what_axioms_conclude_is_queried(by_axioms):
    knowledge, state = by_axioms
    result = knowledge.query(
        "SELECT ?p WHERE { suave:hull suave:hasPart ?p }", state, inferred=True
    )
    assert result.rows == (("suave:c_thruster_1",), ("suave:motor",))


def test_decisions_do_not_depend_on_whether_all_is_inferred(by_axioms):
    knowledge, state = by_axioms
    assert knowledge.decide(state).plan == knowledge.infer(state).plan


@pytest.mark.parametrize(
    ("circular", "told", "untold"),
    [
        (
            'a1: fd_realisability(fd_spiral_high, false) -> fg_status(fg_spiral_high, "IN_ERROR_NFR")\n'
            'a2: fg_status(fg_spiral_high, "IN_ERROR_NFR") -> fd_realisability(fd_spiral_high, false)\n'
            'a3: c_status(c_thruster_1, "FALSE") -> fg_status(fg_spiral_high, "IN_ERROR_NFR")',
            ["a2", "a3", "c_thruster_1"],
            ["a1"],
        ),
        (  # all of a rule's body must follow from elsewhere, and not a part of it
            'a1: fd_realisability(fd_spiral_low, false) ^ c_status(c_thruster_1, "FALSE")'
            " -> fd_realisability(fd_spiral_high, false)\n"
            "a2: fd_realisability(fd_spiral_high, false) -> fd_realisability(fd_spiral_low, false)\n"
            'a3: c_status(c_thruster_1, "FALSE") -> fd_realisability(fd_spiral_high, false)',
            ["a3", "c_thruster_1"],
            ["a1", "a2"],
        ),
    ],
)
def test_a_reason_does_not_rest_on_what_it_explains(tmp_path, circular, told, untold):
    """The first two rules alone conclude each other's bodies; only the third starts from a fact."""
    (tmp_path / "own.swrl").write_text(circular + "\n", encoding="utf-8")
    knowledge = KnowledgeBase.load(rules=tmp_path / "own.swrl")
    state = knowledge.state(
        groundings={SEARCH: "fd_spiral_high"}, components={"c_thruster_1": "FALSE"}
    )
    text = str(knowledge.explain(state, "fd_realisability(fd_spiral_high, false)"))
    places = [text.index(name) for name in told]
    assert places == sorted(places) and not any(name in text for name in untold)
