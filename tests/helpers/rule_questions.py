"""Why does my rule not fire: the questions that users of Protégé, Pellet and owlready2 ask again and again.

A rule that is ignored without a word, values that look equal and are not, names that nothing declares, individuals
without a name, negation.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from suave_des.kb.states import ManagingSettings, StateBuilder
from suave_des.kb.why_not import RuleQuestions
from suave_des.knowledge.state import KnowledgeState
from suave_des.scenario.loader import load_scenario
from tests.helpers.owl_text import SUAVE, XSD

SEARCH, MOTION = "f_generate_search_path", "f_maintain_motion"
HIGH = {"groundings": {SEARCH: "fd_spiral_high"}}
MEASURED = "hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v)"
OWL = "http://www.w3.org/2002/07/owl#"
PROPERTY = f'<owl:DatatypeProperty rdf:about="{SUAVE}depth_class"/>'
WORKING = f"""
<owl:Class rdf:about="{SUAVE}Failed"/>
<owl:Class rdf:about="{SUAVE}Working"><owl:equivalentClass><owl:Class>
<owl:complementOf rdf:resource="{SUAVE}Failed"/></owl:Class></owl:equivalentClass></owl:Class>
"""
TAGGED = f"""
<rdf:Description rdf:about="{SUAVE}c_thruster_1"><suave:depth_class xmlns:suave="{SUAVE}"
xml:lang="en">deep</suave:depth_class></rdf:Description>
"""
WHOLE = f"""
<rdf:Description rdf:about="{SUAVE}c_thruster_1"><suave:depth_class xmlns:suave="{SUAVE}"
rdf:datatype="{XSD}double">3.0</suave:depth_class></rdf:Description>
"""

# What is asked, the rule, the state (and what is asserted besides), what the ontology has more, and the answer.
CASES: dict[str, tuple[Any, ...]] = {
    "a comparison that is misspelt": (
        f"r: {MEASURED} ^ swrlb:lesThan(?v, 3.0) -> fd_realisability(fd_spiral_high, false)",
        HIGH,
        "",
        "never fires: there is no builtin lesThan in Pellet (line 1, column 78); did you mean lessThan?",
    ),
    "a built-in of another rule engine": (
        "prefix temporal: <http://swrl.stanford.edu/ontologies/built-ins/3.3/temporal.owl#>\n"
        "r: Component(?c) ^ temporal:before(?c, ?d) -> Component(?d)",
        {},
        "",
        "never fires: ",
    ),
    "an integer where the values are decimals": (
        "r: hasValue(?q, 1) -> QAvalue(?q)",
        {},
        "",
        "never fires: 1 is not a decimal, the range of hasValue: it never matches (line 1, column 17); write 1.0",
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
        "never fires: hasDepth is not defined (line 1, column 4)",
    ),
    "a class with a typo": (
        "r: FunctionGroundng(?fg) -> fd_realisability(fd_spiral_high, false)",
        HIGH,
        "",
        "never fires: FunctionGroundng is not defined (line 1, column 4); did you mean FunctionGrounding?",
    ),
    "an individual with a typo": (
        "r: isQAtype(?q, water_visibilty) -> QAvalue(?q)",
        {},
        "",
        "never fires: water_visibilty is not defined (line 1, column 17); did you mean water_visibility?",
    ),
    "a text in another case": (
        'r: c_status(?c, "Failed") -> Component(?c)',
        {"facts": ["c_status(c_thruster_1, FAILED)"]},
        "",
        'c_status(?c, "Failed") does not hold: found c_status "FAILED", needed "Failed"; they differ in case or spaces',
    ),
    "a truth value where there is text": (
        None,
        {"components": {"c_thruster_1": "FALSE"}, "facts": ["Binding(b)", "binding_component(b, c_thruster_1)"]},
        "",
        'c_status(?c, false) does not hold: found c_status "FALSE" of c_thruster_1, needed false; string and boolean '
        'never match, even where they look alike: write "FALSE"',
        "S2",
    ),
    "text in a language": (
        'r: depth_class(?c, "deep") -> Component(?c)',
        {},
        PROPERTY + TAGGED,
        'depth_class(?c, "deep") does not hold: found depth_class "deep"@en, needed "deep"; @en and string never '
        'match, even where they look alike: write "deep"@en',
    ),
    "negation as what is not known": (
        "r: Component(?c) ^ Working(?c) -> fd_realisability(fd_spiral_high, false)",
        {},
        WORKING,
        "Working(?c) does not hold: c_thruster_1 is not known to be a Working; Working is defined by complementOf, "
        "which never follows from missing facts (open world)",
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
        "never fires: ?fd occurs in the head, but the body does not bind it (line 1, column 36)",
    ),
    "a compared variable that nothing binds": (
        "r: QAvalue(?q) ^ lessThan(?v, 3.0) -> fd_realisability(fd_spiral_high, false)",
        {},
        "",
        "never fires: ?v has no value in lessThan: no other atom binds it (line 1, column 27)",
    ),
    "a data property with an individual": (
        "r: c_status(?c, c_thruster_1) -> Component(?c)",
        {},
        "",
        "never fires: c_status: c_thruster_1 is an individual where a value is needed",
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
    "a rule meant to replace a value": (
        'r: Component(?c) ^ depth_class(?c, "deep") -> depth_class(?c, "shallow")',
        {"facts": ["depth_class(c_thruster_1, deep)"]},
        PROPERTY,
        "it fires with ?c = c_thruster_1, and concludes depth_class(c_thruster_1, shallow); depth_class(c_thruster_1, "
        "deep) remains as well, because rules only add values",
    ),
    "a state that contradicts itself": (
        None,
        HIGH | {"measurements": {"water_visibility": 1}, "facts": ["fg_status(fg_spiral_high, OK)"]},
        "",
        "nothing follows, as the state contradicts itself: ",
        "S1b",
    ),
}


@dataclass(frozen=True)
class Asked:
    """A question, ready to be asked, and its answer.

    Attributes:
        questions: about the rules of a knowledge base with what the case adds.
        rule: the rule that is asked about.
        state: the state in which it does not fire.
        answer: part of what is said.
    """

    questions: RuleQuestions
    rule: str
    state: KnowledgeState
    answer: str


def prepared(name: str, ontology: Path, folder: Path) -> Asked:
    """Load what a case needs.

    Args:
        name: of the case.
        ontology: suave.owl with what the case adds.
        folder: gets the file with its rule.
    """
    text, parts, _, answer, *names = CASES[name]
    parts = dict(parts)
    facts = parts.pop("facts", ())
    rules = folder / "mine.swrl"
    rules.write_text((text or "") + "\n", encoding="utf-8")
    loaded = load_scenario("seams2023", ontologies=[ontology], rules=[rules])
    questions = RuleQuestions.open(loaded, facts)
    builder = StateBuilder(questions.base, ManagingSettings.of(loaded.scenario))
    for kind, content in parts.items():
        for thing, value in content.items():
            builder.add(kind, thing, value)
    return Asked(questions, (names or ["r"])[0], builder.state(), answer)
