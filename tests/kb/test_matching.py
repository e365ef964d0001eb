"""Atoms are matched in an order in which each can be tested, and the nearest match tells most."""

import pytest

from suave_des.kb import matching
from suave_des.knowledge.rdf import RDF_TYPE, SWRLB, XSD, Lit
from suave_des.knowledge.rules import DIFFERENT, Atom, Rule, Variable

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
