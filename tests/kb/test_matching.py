"""Atoms are matched with facts, in an order in which each can be tested; the nearest match tells
most.
"""

import pytest

from suave_des.kb import matching
from suave_des.kb.matching import Facts, concluding, instance, matched, matches, stated, unified
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import RDF_TYPE, SWRLB, XSD, Lit
from suave_des.knowledge.rules import DIFFERENT, Atom, Named, Rule, Variable

NS = "http://example.org/matching#"
X, Y, Z, V, W = map(Variable, "xyzvw")


def kind(name, term):
    return Atom("class", NS + name, (term,))


def has(name, subject, value):
    return Atom("data", NS + name, (subject, value))


def number(text):
    return Lit(text, XSD + "decimal")


def less(one, other):
    return Atom("builtin", SWRLB + "lessThan", (one, other))


@pytest.mark.parametrize(
    ("body", "order"),
    [
        ([less(V, number("2")), has("value", X, V)], [1, 0]),
        (  # as soon as both of its variables have values, and not after all that bind any
            [kind("A", X), kind("B", Y), Atom("different", DIFFERENT, (X, Y)), kind("C", Z)],
            [0, 1, 2, 3],
        ),
        (
            [
                less(W, number("2")),
                Atom("builtin", SWRLB + "add", (W, V, number("1"))),
                has("value", X, V),
            ],
            [2, 1, 0],
        ),
    ],
    ids=["a test before what it tests", "no later than it can be", "a computed value"],
)
def test_an_atom_is_tested_after_those_that_give_its_variables_values(body, order):
    assert matching.testable_order(body) == order


def failing(body, *facts):
    rule = Rule("r", tuple(body), (kind("Head", X),))
    return matching.nearest_match(rule, matching.Facts(facts))


ONE, OTHER = NS + "one", NS + "other"


def test_a_comparison_that_fails_is_nearer_than_a_value_that_differs():
    """`one` has another flag and a value that is small enough, `other` the flag and a value that is
    too large.
    """
    body = [kind("A", X), has("flag", X, Lit("on", XSD + "string")), has("value", X, V)]
    facts = [
        *((each, RDF_TYPE, NS + "A") for each in (ONE, OTHER)),
        (ONE, NS + "flag", Lit("off", XSD + "string")),
        (OTHER, NS + "flag", Lit("on", XSD + "string")),
        (ONE, NS + "value", number("1")),
        (OTHER, NS + "value", number("3")),
    ]
    binding, numbers = failing([*body, less(V, number("2"))], *facts)
    assert (binding["x"], numbers) == (OTHER, (3,))


def test_a_value_that_differs_is_nearer_than_none():
    """Both lack what the rule asks for; of `one` nothing is known, `other` has another value."""
    on = Lit("on", XSD + "string")
    facts = [
        *((each, RDF_TYPE, NS + "A") for each in (ONE, OTHER, NS + "third")),
        (OTHER, NS + "flag", Lit("off", XSD + "string")),
        (NS + "lamp", NS + "flag", on),
    ]
    binding, numbers = failing([kind("A", X), has("flag", X, on)], *facts)
    assert (binding["x"], numbers) == (OTHER, (1,))


def test_of_matches_that_are_as_near_the_one_in_which_a_later_atom_fails_is_told():
    """`one` has the first value only, `other` the second only: the rule gets further with `one`."""
    on, off = (Lit(text, XSD + "string") for text in ("on", "off"))
    facts = [
        *((each, RDF_TYPE, NS + "A") for each in (ONE, OTHER)),
        (ONE, NS + "first", on),
        (ONE, NS + "second", off),
        (OTHER, NS + "first", off),
        (OTHER, NS + "second", on),
    ]
    for first, second, nearest in (("first", "second", ONE), ("second", "first", OTHER)):
        binding, numbers = failing([kind("A", X), has(first, X, on), has(second, X, on)], *facts)
        assert (binding["x"], numbers) == (nearest, (2,))


# One atom and one fact.

A = Named(ONE)
TWO = number("2")


def relates(name, subject, other):
    return Atom("object", NS + name, (subject, other))


@pytest.mark.parametrize(
    ("terms", "values", "binding", "extended"),
    [
        ((X, Y), (ONE, OTHER), {}, {"x": ONE, "y": OTHER}),
        ((X, X), (ONE, ONE), {}, {"x": ONE}),
        ((X, X), (ONE, OTHER), {}, None),
        ((X,), (OTHER,), {"x": ONE}, None),
        ((X,), (None,), {}, {}),
        ((A,), (ONE,), {}, {}),
        ((A,), (OTHER,), {}, None),
        ((X,), (number("2.0"),), {"x": TWO}, {"x": TWO}),
        ((number("2.0"),), (TWO,), {}, {}),
    ],
    ids=[
        "each variable",
        "one variable twice",
        "one variable with two values",
        "a variable with another value",
        "any value",
        "a name",
        "another name",
        "the same number written otherwise",
        "a literal written otherwise",
    ],
)
def test_a_binding_is_extended_so_that_terms_have_values(terms, values, binding, extended):
    assert unified(terms, values, binding) == extended


def test_the_binding_that_is_extended_stays_as_it_is():
    binding = {"x": ONE}
    unified((Y,), (OTHER,), binding)
    assert binding == {"x": ONE}


IS_A = (ONE, RDF_TYPE, NS + "A")
HAS_TWO = (ONE, NS + "value", TWO)


@pytest.mark.parametrize(
    ("atom", "triple", "binding"),
    [
        (kind("A", X), IS_A, {"x": ONE}),
        (kind("B", X), IS_A, None),
        (has("value", X, V), HAS_TWO, {"x": ONE, "v": TWO}),
        (has("size", X, V), HAS_TWO, None),
        (has("value", X, number("3")), HAS_TWO, None),
        (relates("near", X, Y), (ONE, NS + "near", OTHER), {"x": ONE, "y": OTHER}),
        (less(X, V), (ONE, SWRLB + "lessThan", TWO), None),
    ],
    ids=[
        "class",
        "another class",
        "data",
        "another property",
        "another value",
        "object",
        "a built-in says no fact",
    ],
)
def test_an_atom_is_matched_with_a_fact(atom, triple, binding):
    assert matched(atom, triple, {}) == binding


@pytest.mark.parametrize(
    ("atom", "triple"),
    [
        (kind("A", X), IS_A),
        (has("value", X, V), HAS_TWO),
        (relates("near", X, A), (ONE, NS + "near", ONE)),
        (has("value", X, W), None),
        (less(V, TWO), None),
    ],
    ids=["class", "data", "object", "a variable without a value", "a built-in"],
)
def test_an_atom_states_a_fact(atom, triple):
    assert stated(atom, {"x": ONE, "v": TWO}) == triple


def test_an_instance_has_the_values_of_those_variables_that_have_one():
    assert instance(has("value", X, V), {"x": ONE}) == has("value", A, V)


def test_a_rule_concludes_a_triple_by_any_atom_of_its_head():
    rule = Rule("r", (), (kind("A", X), has("value", Y, V)))
    assert list(concluding(rule, [HAS_TWO, IS_A])) == [{"x": ONE}, {"y": ONE, "v": TWO}]


# Facts.


def test_facts_are_looked_up_by_subject():
    facts = Facts([HAS_TWO, (OTHER, NS + "value", number("3"))])
    assert facts.values(OTHER, NS + "value") == [number("3")]


def test_or_for_any_subject():
    facts = Facts([HAS_TWO, (OTHER, NS + "value", number("3"))])
    assert facts.values(None, NS + "value") == [TWO, number("3")]


def test_a_value_that_several_facts_have_is_one():
    facts = Facts([HAS_TWO, (OTHER, NS + "value", number("2.0"))])
    assert facts.values(None, NS + "value") == [TWO]


@pytest.mark.parametrize("triple", [IS_A, HAS_TWO])
def test_a_fact_is_known(triple):
    assert triple in Facts([IS_A, HAS_TWO])


@pytest.mark.parametrize("triple", [(OTHER, *IS_A[1:]), (*HAS_TWO[:2], number("3"))])
def test_another_is_not(triple):
    assert triple not in Facts([IS_A, HAS_TWO])


# All matches of a rule.

PAIR = Rule("r", (kind("A", X), relates("near", X, Y), kind("B", Y)), (kind("Head", X),))
PAIRS = Facts(
    [
        *((each, RDF_TYPE, NS + "A") for each in (OTHER, ONE)),
        *((each, RDF_TYPE, NS + "B") for each in (OTHER, ONE)),
        (OTHER, NS + "near", ONE),
        (ONE, NS + "near", OTHER),
        (ONE, NS + "near", NS + "neither"),
    ]
)
BOTH = [{"x": ONE, "y": OTHER}, {"x": OTHER, "y": ONE}]


def test_a_rule_matches_in_all_ways_in_a_fixed_order():
    assert matches(PAIR, PAIRS) == BOTH


def test_those_that_extend_a_binding_are_some_of_them():
    assert matches(PAIR, PAIRS, {"y": ONE}) == BOTH[1:]


def test_of_a_rule_that_matches_no_atom_fails_in_the_nearest_match():
    assert matching.nearest_match(PAIR, PAIRS) == (BOTH[0], ())


def test_what_nothing_is_known_of_fails_in_any_case():
    assert failing([kind("A", X), kind("Unknown", X)], IS_A) == ({"x": ONE}, (1,))


# What Pellet tells.


def test_bodies_that_hold_are_told_apart_from_what_follows():
    holds = (f"{matching.PROBE}#it", f"{matching.PROBE}#holds", Lit("3", XSD + "string"))
    assert matching.told_of(Ontology.load(), [IS_A, holds]) == ({IS_A}, {3})
