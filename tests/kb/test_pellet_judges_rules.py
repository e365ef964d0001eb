"""What is said of a rule is what Pellet does with it: one that is said not to fire can be switched
off, and nothing changes.
"""

from __future__ import annotations

import itertools
import random
import re
from collections.abc import Sequence
from dataclasses import replace

import pytest

from suave_des.errors import KnowledgeError, Level
from suave_des.kb.explain import RuleQuestions
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.states import ManagingSettings
from suave_des.knowledge.checks import Subject, findings_in
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.rdf import OWL, SWRLB, XSD, Lit, Triple
from suave_des.knowledge.rules import DIFFERENT, SAME, Atom, Named, Rule, Term, Variable
from suave_des.knowledge.rules.files import fatal_problems
from suave_des.knowledge.state import ContradictionError, KnowledgeState
from tests.helpers.knowledge_states import MOTION, SEARCH

NS = "http://example.org/judged#"
HEADER = f"""<rdf:RDF xmlns="{NS}" xml:base="{NS[:-1]}" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
 xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#" xmlns:owl="{OWL}" xmlns:xsd="{XSD}"
 xmlns:swrl="http://www.w3.org/2003/11/swrl#" xmlns:swrlb="{SWRLB}"><owl:Ontology rdf:about="{NS[:-1]}"/>
"""
ONTOLOGY = """
<owl:Class rdf:about="#A"/><owl:Class rdf:about="#B"/><owl:Class rdf:about="#C"/>
<owl:ObjectProperty rdf:about="#p"/><owl:ObjectProperty rdf:about="#q"/>
<owl:DatatypeProperty rdf:about="#number"><rdfs:range rdf:resource="http://www.w3.org/2001/XMLSchema#decimal"/>
</owl:DatatypeProperty><owl:DatatypeProperty rdf:about="#count"/><owl:DatatypeProperty rdf:about="#text"/>
<owl:DatatypeProperty rdf:about="#truth"/><owl:DatatypeProperty rdf:about="#day"/><owl:DatatypeProperty rdf:about="#out"/>
<A rdf:about="#i"><p rdf:resource="#j"/><owl:differentFrom rdf:resource="#j"/>
<number rdf:datatype="http://www.w3.org/2001/XMLSchema#decimal">2.5</number>
<count rdf:datatype="http://www.w3.org/2001/XMLSchema#integer">2020</count>
<day rdf:datatype="http://www.w3.org/2001/XMLSchema#date">2020-01-15</day><odd rdf:resource="#stray"/></A>
<A rdf:about="#j"><q rdf:resource="#i"/><text rdf:datatype="http://www.w3.org/2001/XMLSchema#string">aXb</text>
<truth rdf:datatype="http://www.w3.org/2001/XMLSchema#boolean">true</truth>
<number rdf:datatype="http://www.w3.org/2001/XMLSchema#integer">3</number></A>
<Loose rdf:about="#k"><owl:sameAs rdf:resource="#j"/></Loose>
"""
INDIVIDUALS = [Variable(name) for name in "xyz"]
VALUES = [Variable(name) for name in "vwu"]
LITERALS = [
    Lit("2.5", XSD + "decimal"),
    Lit("2020", XSD + "integer"),
    Lit("1", XSD + "integer"),
    Lit("aXb", XSD + "string"),
    Lit("true", XSD + "boolean"),
    Lit("2020-01-15", XSD + "date"),
    Lit("3", XSD + "integer"),
    Lit("x", XSD + "integer"),
]
BUILTINS = {
    "greaterThan": 2,
    "notEqual": 2,
    "add": 3,
    "booleanNot": 2,
    "date": 4,
    "stringConcat": 3,
    "upperCase": 2,
    "matches": 2,
    "lesThan": 2,
}
EXPRESSION = (
    ("_:e0", "http://www.w3.org/1999/02/22-rdf-syntax-ns#type", OWL + "Restriction"),
    ("_:e0", OWL + "onProperty", NS + "p"),
    ("_:e0", OWL + "someValuesFrom", OWL + "Thing"),
)

RDF_NS = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
DATA_RANGE = (
    ("_:e0", RDF_NS + "type", "http://www.w3.org/2000/01/rdf-schema#Datatype"),
    ("_:e0", OWL + "onDatatype", XSD + "decimal"),
    ("_:e0", OWL + "withRestrictions", "_:e1"),
    ("_:e1", RDF_NS + "first", "_:e2"),
    ("_:e1", RDF_NS + "rest", RDF_NS + "nil"),
    ("_:e2", XSD + "minInclusive", Lit("2.5", XSD + "decimal")),
)


def individual(draw: random.Random) -> Term:
    names = [Named(NS + name) for name in ("i", "j", "stray", "nobody")]
    return draw.choice([*INDIVIDUALS * 3, *names])


def value(draw: random.Random) -> Term:
    return draw.choice([*VALUES * 4, *LITERALS])


def atom(draw: random.Random) -> Atom:
    kind = draw.choice(["class", "object", "data", "builtin", "range", "identity", "data", "class"])
    if kind == "class":
        if draw.random() < 0.2:
            return Atom("class", "_:p some Thing", (individual(draw),), (), EXPRESSION)
        return Atom("class", NS + draw.choice("ABC"), (individual(draw),))
    if kind == "object":
        name = draw.choice(["p", "q", "odd", "even"])
        return Atom("object", NS + name, (individual(draw), individual(draw)))
    if kind == "data":
        name = draw.choice(["number", "count", "text", "truth", "day", "loose"])
        return Atom("data", NS + name, (individual(draw), value(draw)))
    if kind == "builtin":
        name = draw.choice([*BUILTINS])
        return Atom("builtin", SWRLB + name, tuple(value(draw) for _ in range(BUILTINS[name])))
    if kind == "range" and draw.random() < 0.4:
        return Atom("range", "_:decimal[>= 2.5]", (value(draw),), (), DATA_RANGE)
    if kind == "range":
        return Atom("range", XSD + draw.choice(["integer", "string", "decimal"]), (value(draw),))
    same = draw.random() < 0.4
    both = (individual(draw), individual(draw))
    return Atom("same", SAME, both) if same else Atom("different", DIFFERENT, both)


def head(draw: random.Random) -> Atom:
    return draw.choice(
        [
            Atom("class", NS + draw.choice(["B", "C", "New"]), (individual(draw),)),
            Atom("object", NS + draw.choice(["q", "even"]), (individual(draw), individual(draw))),
            Atom("data", NS + "out", (individual(draw), value(draw))),
            Atom("data", NS + "count", (individual(draw), value(draw))),
        ]
    )


def generated(number: int) -> list[Rule]:
    draw = random.Random(number)
    rules = []
    for count in range(draw.randint(2, 5)):
        body = tuple(atom(draw) for _ in range(draw.randint(1, 3)))
        rules.append(Rule(f"r{count}", body, (head(draw),)))
    return rules


def with_rules(base: Ontology, rules: Sequence[Rule]) -> Ontology:
    changed = base.with_rules(rules)
    return replace(changed, vocabulary=base.vocabulary.with_rules(rules))


def inferred(base: Ontology, state: KnowledgeState) -> frozenset[Triple] | str:
    """All that follows, or that the state contradicts itself."""
    try:
        pellet = InProcessPellet(base, base.content.all_terms())
        return pellet.infer(base.assertions(state))
    except ContradictionError:
        return "contradiction"


def differing(base: Ontology, state: KnowledgeState) -> tuple[list[str], int]:
    """What is said of rules that Pellet contradicts, and how many rules fire."""
    base = RuleQuestions(base)._usable  # with a rule that Pellet drops nothing is inferred
    # Individuals that a rule alone mentions are there without it, too. All are different: else
    # Pellet infers by cases, and not the same each time.
    others = [Named(NS + name) for name in ("i", "stray", "nobody")]
    base = base.with_facts(
        (one.iri, DIFFERENT, other.iri) for one, other in itertools.combinations(others, 2)
    )
    questions, found, firing = RuleQuestions(base), list[str](), 0
    whole = inferred(base, state)
    for rule in base.content.enabled_rules:
        answer = questions.of(rule, state)
        firing += answer.fires
        if answer.fires and fatal_problems(rule, base.vocabulary):
            found.append(f"{rule.text}: it fires, but is an error")
        if not answer.fires and whole != "contradiction":
            fewer = base.with_rules(one for one in base.rules if one is not rule)
            rest = inferred(fewer, state)
            if rest == "contradiction" or not whole <= rest:  # what follows needs the rule
                found.append(str(answer))
    return found, firing


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Ontology:
    path = tmp_path_factory.mktemp("judged") / "judged.owl"
    path.write_text(f"{HEADER}{ONTOLOGY}</rdf:RDF>", encoding="utf-8")
    return Ontology.load([path])


@pytest.mark.parametrize("count", [60, pytest.param(1400, marks=pytest.mark.slow)])
def test_a_generated_rule_that_is_said_not_to_fire_changes_nothing(small, count):
    firing = 0
    for number in range(count):
        rules = generated(number)
        if any(rule.identities_of_names for rule in rules):
            continue  # of which `kb check` says that Pellet's inferences are not the same each time
        try:
            found, fires = differing(with_rules(small, rules), KnowledgeState())
        except KnowledgeError as error:  # of Pellet itself, in one of a hundred
            assert "Pellet cannot use the ontologies" in str(error)
            continue
        assert found == [], number
        firing += fires
    assert firing > count / 15


@pytest.mark.parametrize("scenario", ["seams2023", "extended"])
def test_a_shipped_rule_that_is_said_not_to_fire_changes_nothing(scenario):
    knowledge = KnowledgeBase.load(scenario=scenario)
    state = knowledge.state(
        groundings={SEARCH: "fd_spiral_high", MOTION: "fd_recover_thrusters"},
        components={"c_thruster_1": "FALSE", "c_thruster_2": "RECOVERED"},
        measurements={"water_visibility": 2.0},
    )
    found, firing = differing(knowledge.base, state)
    assert found == [] and firing > 3


#: What was said never to fire, or to be an error, and fires: rules of ontologies, as XML.
FIRING = {
    "booleanNot that computes": (
        "",
        "truth(?x, ?y) ^ booleanNot(?z, ?y) -> B(?x)",
    ),
    "booleanNot from its result": (
        "",
        "truth(?x, ?y) ^ booleanNot(?y, ?z) -> B(?x)",
    ),
    "parts of a date": ("", "day(?x, ?d) ^ date(?d, 2020, ?m, ?n) ^ lessThan(?m, 2) -> B(?x)"),
    "individuals that are declared different": ("", "differentFrom(?x, ?y) -> q(?x, ?y)"),
    "what a rule concludes that nobody declared": (
        "",
        "A(?x) -> <http://example.org/judged#New>(?x)",
    ),
    "what nobody declared and something has": (
        "",
        "<http://example.org/judged#Loose>(?x) -> B(?x)",
    ),
    "a whole number that something has": ("", "number(?x, 3) -> B(?x)"),
    "a variable that is not declared": (
        """<swrl:Variable rdf:about="#x"/><swrl:Imp rdf:about="#R"><rdfs:label>R</rdfs:label>
        <swrl:body rdf:parseType="Collection"><swrl:DatavaluedPropertyAtom>
        <swrl:propertyPredicate rdf:resource="#text"/><swrl:argument1 rdf:resource="#x"/>
        <swrl:argument2 rdf:resource="#y"/></swrl:DatavaluedPropertyAtom></swrl:body>
        <swrl:head rdf:parseType="Collection"><swrl:ClassAtom><swrl:classPredicate rdf:resource="#B"/>
        <swrl:argument1 rdf:resource="#x"/></swrl:ClassAtom></swrl:head></swrl:Imp>""",
        "",
    ),
    "a class expression and a data range": (
        """<swrl:Variable rdf:about="#x"/><swrl:Variable rdf:about="#y"/>
        <swrl:Imp rdf:about="#R"><rdfs:label>R</rdfs:label>
        <swrl:body rdf:parseType="Collection"><swrl:ClassAtom><swrl:classPredicate><owl:Restriction>
        <owl:onProperty rdf:resource="#p"/><owl:someValuesFrom rdf:resource="http://www.w3.org/2002/07/owl#Thing"/>
        </owl:Restriction></swrl:classPredicate><swrl:argument1 rdf:resource="#x"/></swrl:ClassAtom>
        <swrl:DatavaluedPropertyAtom><swrl:propertyPredicate rdf:resource="#number"/>
        <swrl:argument1 rdf:resource="#x"/><swrl:argument2 rdf:resource="#y"/></swrl:DatavaluedPropertyAtom>
        <swrl:DataRangeAtom><swrl:dataRange><rdfs:Datatype>
        <owl:onDatatype rdf:resource="http://www.w3.org/2001/XMLSchema#decimal"/>
        <owl:withRestrictions rdf:parseType="Collection"><rdf:Description>
        <xsd:minInclusive rdf:datatype="http://www.w3.org/2001/XMLSchema#decimal">2.5</xsd:minInclusive>
        </rdf:Description></owl:withRestrictions></rdfs:Datatype></swrl:dataRange>
        <swrl:argument1 rdf:resource="#y"/></swrl:DataRangeAtom></swrl:body>
        <swrl:head rdf:parseType="Collection"><swrl:ClassAtom><swrl:classPredicate rdf:resource="#B"/>
        <swrl:argument1 rdf:resource="#x"/></swrl:ClassAtom></swrl:head></swrl:Imp>""",
        "",
    ),
}


@pytest.fixture(scope="module", params=FIRING)
def firing(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[KnowledgeBase, Subject]:
    """A knowledge base whose rule R fires, and its files."""
    xml, text = FIRING[request.param]
    apart = ONTOLOGY.replace('<owl:sameAs rdf:resource="#j"/>', "")
    if "differentFrom" in text:  # with which Pellet fails where there are values
        apart = re.sub(r"<\w+ rdf:datatype[^<]*<[^>]*>", "", apart)
    folder = tmp_path_factory.mktemp("firing")
    (folder / "o.owl").write_text(f"{HEADER}{apart}{xml}</rdf:RDF>", encoding="utf-8")
    (folder / "r.swrl").write_text(f"R: {text}\n" if text else "", encoding="utf-8")
    files = Subject([folder / "o.owl"], [folder / "r.swrl"])
    base = Ontology.load(files.ontologies, rules=files.rules)
    return KnowledgeBase.of(base, ManagingSettings(), "pellet", TimeLimit(60.0)), files


def test_a_rule_that_fires_is_said_to(firing):
    answer = RuleQuestions(firing[0].base).why_not("R", KnowledgeState())
    assert answer.fires, answer


def test_a_rule_that_fires_is_neither_an_error_nor_said_never_to_fire(firing):
    knowledge, files = firing
    told = [each for each in findings_in(knowledge.base, files) if each.rule == "R"]
    assert not [each for each in told if each.level is Level.ERROR or "never fire" in each.message]


def test_all_that_pellet_infers_by_a_rule_is_explained_by_it(firing):
    knowledge, state = firing[0], KnowledgeState()
    without = knowledge.changed(knowledge.base.with_rules(()))
    concluded = knowledge.infer(state).inference.facts - without.infer(state).inference.facts
    assert concluded
    for fact in concluded:
        (derivation,) = knowledge.explain(state, str(fact)).facts
        assert derivation.rule == "R", fact


def test_a_rule_fires_where_what_it_concludes_has_no_variable(small):
    # i and j are different, so that nobody differs from one of them; from which is not known.
    differs = Atom("different", DIFFERENT, (Variable("x"), Named(NS + "nobody")))
    rule = Rule("r", (differs,), (Atom("class", NS + "C", (Named(NS + "nobody"),)),))
    answer = RuleQuestions(with_rules(small, [rule])).why_not("r", KnowledgeState())
    assert str(answer) == "r: it fires, and concludes C(nobody)"
