"""kb why-not: why a rule does not fire, in one line."""

import itertools
from pathlib import Path

import pytest

from suave_des.errors import InputError
from suave_des.kb.explain import RuleQuestions
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.states import FactReader, ManagingSettings, StateBuilder
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import KnowledgeState
from suave_des.scenario.loader import load_scenario
from suave_des.scenario_knowledge import open_base
from tests.helpers.checks import subject
from tests.helpers.number_ontology import NS, NUMBERS, numbers_ontology
from tests.helpers.owl_text import SUAVE, XSD, individual, rule

SEARCH = "f_generate_search_path"
HIGH = {"groundings": {SEARCH: "fd_spiral_high"}}
MEASURED = "hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v)"
OWL = "http://www.w3.org/2002/07/owl#"
PROPERTY = f'<owl:DatatypeProperty rdf:about="{SUAVE}depth_class"/>'
WORKING = f"""
<owl:Class rdf:about="{SUAVE}Failed"/>
<owl:Class rdf:about="{SUAVE}Working"><owl:equivalentClass><owl:Class>
<owl:complementOf rdf:resource="{SUAVE}Failed"/></owl:Class></owl:equivalentClass></owl:Class>
"""
WHOLE = f"""
<rdf:Description rdf:about="{SUAVE}c_thruster_1"><suave:depth_class xmlns:suave="{SUAVE}"
rdf:datatype="{XSD}double">3.0</suave:depth_class></rdf:Description>
"""

# What is asked, the rule, the state (and what is asserted besides), what the ontology has more, and
# the answer.
CASES = {
    "a comparison that is misspelt": (
        f"r: {MEASURED} ^ swrlb:lesThan(?v, 3.0) -> fd_realisability(fd_spiral_high, false)",
        HIGH,
        "",
        "line 1, column 78: rule r: there is no builtin lesThan in Pellet (did you mean lessThan?)",
    ),
    "a built-in of another rule engine": (
        "prefix temporal: <http://swrl.stanford.edu/ontologies/built-ins/3.3/temporal.owl#>\n"
        "r: Component(?c) ^ temporal:before(?c, ?d) -> Component(?d)",
        {},
        "",
        "mine.swrl: line 2, column 20: ",
    ),
    "an integer where the values are decimals": (
        "r: hasValue(?q, 1) -> QAvalue(?q)",
        {},
        "",
        "never fires: 1 is not a decimal, the range of hasValue: it never matches; write 1.0",
    ),
    "an exact number and an inexact one": (
        "r: depth_class(?c, 3.0) -> Component(?c)",
        {},
        PROPERTY + WHOLE,
        "depth_class(?c, 3.0) does not hold: found depth_class 3.0, needed 3.0; double and decimal never match, even "
        'where they look alike: write "3.0"^^xsd:double',
    ),
    "a number in quotes": (
        f'r: {MEASURED} ^ lessThan(?v, "3.0") -> fd_realisability(fd_spiral_high, false)',
        HIGH | {"measurements": {"water_visibility": 2}},
        "",
        'lessThan(?v, "3.0") does not hold: "3.0" is text, and never compares with the number 2 (?v); write it without '
        "quotes",
    ),
    "a property that nothing declares": (
        "r: hasDepth(?fg, ?d) -> fd_realisability(fd_spiral_high, false)",
        HIGH,
        "",
        "line 1, column 4: hasDepth is not defined",
    ),
    "a class with a typo": (
        "r: FunctionGroundng(?fg) -> fd_realisability(fd_spiral_high, false)",
        HIGH,
        "",
        "line 1, column 4: FunctionGroundng is not defined (did you mean FunctionGrounding?)",
    ),
    "an individual with a typo": (
        "r: isQAtype(?q, water_visibilty) -> QAvalue(?q)",
        {},
        "",
        "line 1, column 17: water_visibilty is not defined (did you mean water_visibility?)",
    ),
    "a text in another case": (
        'r: c_status(?c, "Failed") -> Component(?c)',
        {"facts": ["c_status(c_thruster_1, FAILED)"]},
        "",
        'c_status(?c, "Failed") does not hold: found c_status "FAILED", needed "Failed"; they differ in case or spaces',
    ),
    "a truth value where there is text": (
        None,
        {
            "components": {"c_thruster_1": "FALSE"},
            "facts": ["Binding(b)", "binding_component(b, c_thruster_1)"],
        },
        "",
        'c_status(?c, false) does not hold: found c_status "FALSE" of c_thruster_1, needed false; string and boolean '
        'never match, even where they look alike: write "FALSE"',
        "S2",
    ),
    "negation as what is not known": (
        "r: Component(?c) ^ Working(?c) -> fd_realisability(fd_spiral_high, false)",
        {},
        WORKING,
        "Working(?c) does not hold: c_thruster_1 is not known to be a Working",
    ),
    "two names for what may be one thing": (
        "r: Component(?a) ^ Component(?b) ^ differentFrom(?a, ?b) -> fd_realisability(fd_spiral_high, false)",
        {},
        "",
        "differentFrom(?a, ?b) does not hold: OWL does not assume that different names mean different individuals: "
        "assert it",
    ),
    "a variable of the head that the body does not bind": (
        "r: Component(?c) -> requiredBy(?c, ?fd)",
        {},
        "",
        "column 36: rule r: ?fd occurs in the head, but the body does not bind it",
    ),
    "a compared variable that nothing binds": (
        "r: QAvalue(?q) ^ lessThan(?v, 3.0) -> fd_realisability(fd_spiral_high, false)",
        {},
        "",
        "column 27: rule r: ?v has no value in lessThan: no other atom binds it",
    ),
    "a data property with an individual": (
        "r: c_status(?c, c_thruster_1) -> Component(?c)",
        {},
        "",
        "c_status: c_thruster_1 is an individual where a value is needed",
    ),
    "a rule that is switched off": (
        "disabled r: Component(?c) -> fd_realisability(fd_spiral_high, false)",
        {},
        "",
        "never fires: it is disabled",
    ),
    "a value on the limit": (
        None,
        HIGH | {"measurements": {"water_visibility": "3.25"}},
        "",
        "lessThan(?measured, ?expected) does not hold: found 3.25 (?measured), needed less than 3.25 (?expected)",
        "QAWaterVisibility",
    ),
    "a fact that another rule would have to conclude": (
        None,
        HIGH | {"measurements": {"water_visibility": 4}},
        "",
        'fg_status(?fg, "IN_ERROR_NFR") does not hold: fg_spiral_high has no fg_status; QAWaterVisibility would '
        "conclude it, but its lessThan(?measured, ?expected) fails: found 4 (?measured), needed less than 3.25 "
        "(?expected)",
        "S1b",
    ),
    "a computed value": (
        f"r: {MEASURED} ^ multiply(?w, ?v, 2.0) ^ greaterThan(?w, 5.0) -> fd_realisability(fd_spiral_high, false)",
        HIGH | {"measurements": {"water_visibility": "2.25"}},
        "",
        "greaterThan(?w, 5.0) does not hold: found 4.5 (?w), needed greater than 5.0",
    ),
    "a state that contradicts itself": (
        None,
        HIGH
        | {"measurements": {"water_visibility": 1}, "facts": ["fg_status(fg_spiral_high, OK)"]},
        "",
        "nothing follows, as the state contradicts itself: ",
        "S1b",
    ),
}


def answered(name: str, ontology: Path, folder: Path) -> str:
    """What is said to a case's question, of suave.owl with what the case adds."""
    text, parts, _, _, *names = CASES[name]
    parts = dict(parts)
    facts = parts.pop("facts", ())
    rules = folder / "mine.swrl"
    rules.write_text((text or "") + "\n", encoding="utf-8")
    loaded = load_scenario("seams2023", ontologies=[ontology], rules=[rules])
    try:
        base = open_base(loaded)
    except InputError as error:
        return str(error)
    reader = FactReader(base)
    reader.declare(facts)
    base = base.with_facts(map(reader.triple, facts))
    builder = StateBuilder(base, ManagingSettings.of(loaded.scenario))
    for kind, content in parts.items():
        for thing, value in content.items():
            builder.add(kind, thing, value)
    return str(RuleQuestions(base).why_not((names or ["r"])[0], builder.state()))


@pytest.mark.parametrize("name", CASES)
def test_recurring_questions_are_answered_in_one_line(name, suave_copy, tmp_path):
    found = answered(name, suave_copy(CASES[name][2]), tmp_path)
    assert "\n" not in found
    assert CASES[name][3] in found


def test_numbers_match_where_they_do_in_pellet(tmp_path):
    base = numbers_ontology(tmp_path)
    found = Reasoner(base, "pellet", terms=base.content.all_terms()).analyze(KnowledgeState()).facts
    questions, rules = RuleQuestions(base), {rule.name: rule for rule in base.rules}
    answers = {
        (thing, name)
        for name, thing in itertools.product(NUMBERS, repeat=2)
        if questions.of(rules[f"is_{name}"], KnowledgeState(), {"x": NS + thing}).fires
    }
    assert answers == {
        (fact.subject, fact.value)
        for fact in found
        if fact.property == "is" and fact.value != "sum"
    }


ASKED = {  # with differentFrom(?x, ?y), or several rules with sameAs and differentFrom, Pellet's inferences are chance
    "what is the same": (
        ("c_thruster_4", "owl:sameAs", "c_thruster_5"),
        "sameAs(c_thruster_4, ?x) ^ Component(?x)",
    ),
    "what is different": (
        ("c_thruster_4", "owl:sameAs", "c_thruster_5"),
        ("c_thruster_6", "owl:differentFrom", "c_thruster_5"),
        "Component(?x) ^ differentFrom(?x, c_thruster_5)",
    ),
    "text that is empty or in a language, and what is not a number": (
        ("c_thruster_1", "suave:note", ""),
        ("c_thruster_2", 'suave:note xml:lang="de"', "hallo"),
        ("c_thruster_3", "suave:note", "hallo"),
        ("c_thruster_4", f'suave:note rdf:datatype="{XSD}double"', "NaN"),
        *(f"note(?x, {text})" for text in ('""', '"()"', '"hallo"', '"hallo"@de', '"hallo"@en')),
        "note(?x, ?v) ^ stringConcat(?w, ?v, ?v) ^ note(?y, ?w) ^ Component(?y)",
        "note(?x, ?v) ^ Component(?x)",
    ),
}


@pytest.fixture(scope="module", params=ASKED)
def fired(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[KnowledgeBase, set[tuple[str, str]]]:
    """A knowledge base with rules of one's own, and which of them fires for what in owlready2."""
    asserted, bodies = (
        [each for each in ASKED[request.param] if isinstance(each, kind)] for kind in (tuple, str)
    )
    extra = f'<owl:DatatypeProperty rdf:about="{SUAVE}note"/><owl:DatatypeProperty rdf:about="{SUAVE}got"/>'
    for thing, element, value in asserted:
        tag = element.split()[0]
        filled = (
            f'<{element} rdf:resource="{SUAVE}{value}"/>'
            if "owl:" in tag
            else f"<{element}>{value}</{tag}>"
        )
        extra += f'<rdf:Description rdf:about="{SUAVE}{thing}" xmlns:suave="{SUAVE}">{filled}</rdf:Description>'
    rules = "".join(f'r{n}: {each} -> got(?x, "r{n}")\n' for n, each in enumerate(bodies))
    given = subject(tmp_path_factory.mktemp("fired"), rules, extra)
    loaded = KnowledgeBase.load(given.ontologies, rules=given.rules, reasoner="owlready2")
    facts = loaded.infer(loaded.state()).inference.facts
    return loaded, {(str(one.subject), str(one.value)) for one in facts if one.property == "got"}


def test_a_rule_is_said_to_fire_where_it_fires_in_owlready2(fired):
    loaded, got = fired
    questions = RuleQuestions(loaded.base)
    own = [rule for rule in loaded.base.rules if rule.file.suffix == ".swrl"]
    components = loaded.base.model.components.items()
    pairs = itertools.product(components, own)
    fires = {
        (thing[0], rule.name)
        for thing, rule in pairs
        if questions.of(rule, loaded.state(), {"x": thing[1]}).fires
    }
    assert fires == got != set()


def test_what_follows_in_owlready2_is_explained_by_the_rule(fired):
    loaded, got = fired
    trees = {
        (str(each.fact.subject), each.rule)
        for each in loaded.explain(loaded.state()).facts
        if each.rule
    }
    assert got
    assert got <= trees


@pytest.mark.parametrize(
    ("name", "answer"),
    [("broken", "there is no builtin lessThn in Pellet"), ("compRecov", "it fires")],
)
def test_a_rule_of_an_ontology_that_pellet_would_drop_spoils_no_other_answer(
    knowledge, suave_copy, name, answer
):
    broken = rule(
        "broken",
        "QAvalue(?q) ^ hasValue(?q, ?v) ^ lessThn(?v, 3.0) -> fd_realisability(:fd_spiral_high, false)",
    )
    questions = RuleQuestions(
        open_base(load_scenario("seams2023", ontologies=[suave_copy(broken)]))
    )
    state = knowledge.state(components={"c_thruster_2": "RECOVERED"})
    assert answer in str(questions.why_not(name, state))


def test_the_command_takes_a_state_as_a_file_with_words(command, tmp_path):
    state = tmp_path / "state.yaml"
    state.write_text("groundings: {f_generate_search_path: fd_spiral_high}\n", encoding="utf-8")
    status, out, _ = command(
        "why-not", "QAWaterVisibility", "--at", state, "--at", "water_visibility=3.4"
    )
    assert status == 0
    assert out.endswith("found 3.4 (?measured), needed less than 3.25 (?expected)\n")


def rules_on_top(tmp_path, text, *ontologies):
    (tmp_path / "own.swrl").write_text(text + "\n", encoding="utf-8")
    return KnowledgeBase.load(list(ontologies), rules=tmp_path / "own.swrl")


def test_of_two_rules_of_a_name_the_one_that_fires_is_told(tmp_path, suave_copy):
    in_owl = [
        rule("twice", f'c_status(?c, "{status}") -> fd_realisability(:fd_spiral_high, false)')
        for status in ("A", "B", "C")
    ]
    knowledge = KnowledgeBase.load(suave_copy("".join(in_owl)))
    for status in "ABC":
        state = knowledge.state(components={"c_thruster_2": status})
        found = RuleQuestions(knowledge.base).why_not("twice", state)
        assert found.fires and "?c = c_thruster_2" in found.answer
    found = RuleQuestions(knowledge.base).why_not("twice", knowledge.state())
    assert str(found).startswith('twice: c_status(?c, "A") does not hold')


NFR = individual("nfr", "QAvalue", ("isQAtype", ":mros:energy"), ("hasValue", "0.5")) + individual(
    "o_generate_search_path", "Objective", ("hasNFR", ":nfr")
)


@pytest.mark.parametrize(
    ("atom", "is_fixed"),
    [
        ("requiredBy(?c, fd_spiral_high)", True),  # which the ontology says, or not
        ("hasNFR(o_generate_search_path, ?n)", False),  # states with the objective have it
        ("fd_realisability(fd_spiral_low, false)", False),  # other rules conclude it
        ("typeFD(?g, fd_spiral_low)", False),  # states with the grounding have it
        ("hasValue(?q, ?v) ^ lessThan(?v, 0.1)", False),  # a comparison
    ],
)
def test_what_neither_a_state_nor_a_rule_can_change_is_told_first(
    tmp_path, suave_copy, atom, is_fixed
):
    knowledge = rules_on_top(
        tmp_path,
        f'r: c_status(?c, "ODD") ^ {atom} -> fd_realisability(fd_spiral_high, false)',
        suave_copy(NFR),
    )
    state = KnowledgeState()
    found = RuleQuestions(knowledge.base).why_not("r", state)
    first = atom.split(" ^ ")[0] if is_fixed else 'c_status(?c, "ODD")'
    assert str(found).startswith(f"r: {first} does not hold")
    assert "(1 more atom fails)" in found.answer
