"""Recursive rules over properties whose values follow from one another: all reasoners infer all of
it, as computed by hand.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from suave_des.knowledge.ontology import Content, Ontology
from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.rdf import OWL, RDF_TYPE, Triple
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.rules import Atom, Rule, Variable
from suave_des.knowledge.state import KnowledgeState

NS = "http://example.org/recursive#"
HEAD = f"""<rdf:RDF xmlns="{NS}" xml:base="{NS[:-1]}" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
 xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#" xmlns:owl="http://www.w3.org/2002/07/owl#"
 xmlns:xsd="http://www.w3.org/2001/XMLSchema#"><owl:Ontology rdf:about="{NS[:-1]}"/>
"""
PROPERTIES, CLASSES = ("p", "q", "r", "s"), ("A", "B")
Fact = tuple[str, ...]  # property, subject, object; or class, individual
Body = list[tuple[str, ...]]
Rules = list[tuple[Body, tuple[str, ...]]]


def written(folder: Path, facts: set[Fact], axioms: list[Fact], rules: Rules) -> Ontology:
    """Write the ontology and its rules, and load them."""
    parts = [f'<owl:Class rdf:about="#{name}"/>' for name in CLASSES]
    parts += [f'<owl:ObjectProperty rdf:about="#{name}"/>' for name in PROPERTIES]
    parts.append('<owl:DatatypeProperty rdf:about="#v"/>')
    for name, *terms in sorted(facts):
        if name == "v":
            value = f'<v rdf:datatype="http://www.w3.org/2001/XMLSchema#integer">{terms[1]}</v>'
            parts.append(f'<owl:Thing rdf:about="#{terms[0]}">{value}</owl:Thing>')
        elif len(terms) == 1:
            parts.append(f'<{name} rdf:about="#{terms[0]}"/>')
        else:
            value = f'<{name} rdf:resource="#{terms[1]}"/>'
            parts.append(f'<owl:Thing rdf:about="#{terms[0]}">{value}</owl:Thing>')
    for kind, one, other in axioms:
        if kind in ("TransitiveProperty", "SymmetricProperty"):
            parts.append(f'<owl:{kind} rdf:about="#{one}"/>')
        elif kind == "propertyChainAxiom":
            links = "".join(f'<rdf:Description rdf:about="#{one}"/>' for _ in range(2))
            chain = f'<owl:{kind} rdf:parseType="Collection">{links}</owl:{kind}>'
            parts.append(f'<rdf:Description rdf:about="#{other}">{chain}</rdf:Description>')
        else:
            parts.append(
                f'<rdf:Description rdf:about="#{one}"><{kind} rdf:resource="#{other}"/></rdf:Description>'
            )
    owl, swrl = folder / "recursive.owl", folder / "recursive.swrl"
    owl.write_text(HEAD + "\n".join(parts) + "</rdf:RDF>", encoding="utf-8")
    texts = (
        f"rule{number}: {' ^ '.join(map(atom, body))} -> {atom(head)}\n"
        for number, (body, head) in enumerate(rules)
    )
    swrl.write_text("".join(texts), encoding="utf-8")
    return Ontology.load([owl], rules=[swrl])


def atom(parts: tuple[str, ...]) -> str:
    return f"{parts[0]}({', '.join(parts[1:])})"


def bindings(body: Body, facts: set[Fact], known: dict[str, str]) -> Iterator[dict[str, str]]:
    """All ways to match a rule's body with facts; comparisons come last in it."""
    if not body:
        yield known
        return
    (name, *terms), *rest = body
    if name == "greaterThan":
        if int(known[terms[0]]) > int(known[terms[1]]):
            yield from bindings(rest, facts, known)
        return
    for other, *values in facts:
        if other == name and len(values) == len(terms):
            found = dict(known)
            if all(found.setdefault(*pair) == pair[1] for pair in zip(terms, values, strict=True)):
                yield from bindings(rest, facts, found)


def follows(facts: set[Fact], axioms: list[Fact], rules: Rules) -> set[Fact]:
    """All that follows, by applying rules and axioms until nothing new comes."""
    schema: Rules = []
    for kind, one, other in axioms:
        joined, link = [(one, "?x", "?y"), (one, "?y", "?z")], [(one, "?x", "?y")]
        if kind == "TransitiveProperty":
            schema.append((joined, (one, "?x", "?z")))
        elif kind == "propertyChainAxiom":
            schema.append((joined, (other, "?x", "?z")))
        elif kind == "SymmetricProperty":
            schema.append((link, (one, "?y", "?x")))
        elif kind == "owl:inverseOf":
            schema += [(link, (other, "?y", "?x")), ([(other, "?x", "?y")], (one, "?y", "?x"))]
        else:
            schema.append((link, (other, "?x", "?y")))
    found = set(facts)
    while True:
        more = {
            (head[0], *(binding[term] for term in head[1:]))
            for body, head in (*rules, *schema)
            for binding in bindings(body, found, {})
        }
        if more <= found:
            return found
        found |= more


def generated(number: int) -> tuple[set[Fact], list[Fact], Rules]:
    """Individuals with facts and numbers, axioms that join values, and rules that read what others
    conclude.
    """
    draw = random.Random(number)
    things = [f"t{n}" for n in range(draw.randint(4, 6))]
    facts: set[Fact] = {("v", thing, str(draw.randint(1, 5))) for thing in things}
    facts |= {(draw.choice(PROPERTIES), *draw.sample(things, 2)) for _ in range(4)}
    facts.add((draw.choice(CLASSES), draw.choice(things)))
    one, other, third, _ = draw.sample(PROPERTIES, 4)
    more = draw.choice(["SymmetricProperty", "owl:inverseOf", "rdfs:subPropertyOf"])
    kind = draw.choice(["TransitiveProperty", "propertyChainAxiom"])
    axioms = [(kind, one, other), (more, other, third)]
    greater = [("v", "?x", "?a"), ("v", "?y", "?b"), ("greaterThan", "?a", "?b")]
    rules: Rules = [(greater, (one, "?x", "?y"))] if draw.random() < 0.7 else []
    for _ in range(3):
        names = [draw.choice([one, other, *PROPERTIES]) for _ in range(2)]
        ends = draw.choice([("?x", "?z"), ("?z", "?x"), ("?y", "?z")])
        rules.append(
            ([(names[0], "?x", "?y"), (names[1], "?y", "?z")], (draw.choice(PROPERTIES), *ends))
        )
    rules.append(([(one, "?x", "?y"), ("A", "?x")], ("B", "?y")))
    rules.append(([(other, "?x", "?y"), ("B", "?x")], ("A", "?y")))
    draw.shuffle(rules)
    return facts, axioms, rules


def told(base: Ontology, name: str) -> set[Fact]:
    """All that a reasoner knows of the properties and classes."""
    reasoner = Reasoner(base, name, TimeLimit(90.0), base.content.all_terms())
    inference = reasoner.analyze(KnowledgeState())
    found: set[Fact] = set()
    for fact in inference.facts | inference.asserted:
        is_class = fact.property == "type"
        found.add(
            (str(fact.value), fact.subject)
            if is_class
            else (fact.property, fact.subject, str(fact.value))
        )
    return {each for each in found if each[0] in (*PROPERTIES, *CLASSES, "v")}


EIGHT: set[Fact] = {("v", f"t{n}", str(n)) for n in range(8)}
GREATER = [("v", "?x", "?a"), ("v", "?y", "?b"), ("greaterThan", "?a", "?b")]
JOIN = [("p", "?x", "?y"), ("p", "?y", "?z"), ("p", "?x", "?z")]


@pytest.fixture(scope="module", params=["pellet", "cached", "owlready2"])
def ordered(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> set[Fact]:
    """What is told of eight numbers that a rule orders by a transitive property, which another
    rule joins.
    """
    axioms: list[Fact] = [("TransitiveProperty", "p", "")]
    rules: Rules = [(GREATER, ("p", "?x", "?y")), (JOIN, ("q", "?x", "?z"))]
    return told(written(tmp_path_factory.mktemp("ordered"), EIGHT, axioms, rules), request.param)


def test_a_transitive_property_that_a_rule_concludes_is_complete(ordered):
    """28 pairs of eight numbers are ordered."""
    assert sum(fact[0] == "p" for fact in ordered) == 28


def test_what_a_rule_joins_of_a_transitive_property_is_complete(ordered):
    """56 threes of eight numbers are ordered: (0, 1, 2) to (5, 6, 7)."""
    assert {fact[1:] for fact in ordered if fact[0] == "q"} == {
        (f"t{high}", f"t{low}")
        for low, high in itertools.combinations(range(8), 2)
        if high > low + 1
    }


@pytest.mark.parametrize("count", [40, pytest.param(400, marks=pytest.mark.slow)])
def test_generated_recursive_rules_conclude_all_that_applying_them_does(tmp_path, count):
    several = 0
    for number in range(count):
        given = generated(number)
        base = written(tmp_path, *given)
        assert told(base, "pellet") == follows(*given), number
        several += bool(base.content.given_back)
    assert several > count / 2


@pytest.mark.parametrize("count", [1, pytest.param(20, marks=pytest.mark.slow)])
def test_stock_owlready2_concludes_the_same_from_generated_recursive_rules(tmp_path, count):
    for number in range(count):
        given = generated(number)
        assert told(written(tmp_path, *given), "owlready2") == follows(*given), number


def test_rules_that_need_one_pass_get_one(kb, tmp_path):
    """The shipped rules read what others conclude, and none of it follows from two other values."""
    assert kb.content.given_back == ()
    rules: Rules = [(JOIN, ("q", "?x", "?y"))]
    assert written(tmp_path, EIGHT, [], rules).content.given_back == ()
    axioms: list[Fact] = [("TransitiveProperty", "r", ""), ("rdfs:subPropertyOf", "r", "p")]
    assert written(tmp_path, EIGHT, axioms, rules).content.given_back == (NS + "p",)


@pytest.mark.parametrize("axiom", ["inverseOf", "equivalentProperty"])
@pytest.mark.parametrize(("one", "other"), [("joined", "asked"), ("asked", "joined")])
def test_what_a_transitive_property_joins_is_given_back_whichever_side_names_the_other(
    axiom, one, other
):
    triples: tuple[Triple, ...] = (
        (f"{NS}joined", RDF_TYPE, f"{OWL}TransitiveProperty"),
        (NS + one, OWL + axiom, NS + other),
    )
    x, y = Variable("x"), Variable("y")
    rule = Rule("R", (Atom("object", f"{NS}asked", (x, y)),), (Atom("class", f"{NS}A", (x,)),))
    assert Content(triples, (), (rule,)).given_back == (f"{NS}asked",)
