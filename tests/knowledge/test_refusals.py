"""What cannot be reasoned with is refused, with one line that says why."""

from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import pytest

from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import KnowledgeState, ObjectiveState, exact
from suave_des.resources import shipped_folder
from tests.helpers.checks import subject
from tests.helpers.knowledge_states import SEARCH, searching
from tests.helpers.owl_text import TOMASYS, individual, rule

OTHER_TOMASYS = "http://www.metacontrol.org/tomasys#"
TWINS = "".join(f'<owl:Class rdf:about="http://{one}.org/#Twin"/>' for one in "ab")
NOISE = (
    individual("noise", "QualityAttributeType")
    + individual("nfr", "QAvalue", ("isQAtype", ":noise"), ("hasValue", "0.5"))
    + individual("o_generate_search_path", "Objective", ("hasNFR", ":nfr"))
)


def with_bytes(folder: Path, name: str, content: bytes) -> Path:
    (folder / name).write_bytes(content)
    return folder / name


def with_rules(folder: Path, content: bytes) -> Ontology:
    return Ontology.load(rules=[with_bytes(folder, "mine.swrl", content)])


def suave_with(folder: Path, extra: str, rules: str = "") -> Ontology:
    """The shipped suave.owl with something added, and rules."""
    given = subject(folder, rules, extra)
    return Ontology.load(given.ontologies, rules=given.rules if rules else ())


def decided(base: Ontology, state: KnowledgeState) -> object:
    reasoner = Reasoner(base, "pellet")
    return reasoner.plan(reasoner.analyze(state))


def two_versions(folder: Path) -> Ontology:
    (mine,) = subject(folder, extra="<!-- mine -->").ontologies
    return Ontology.load([mine, shipped_folder("ontology") / "suave.owl"])


def with_a_damaged_catalog(folder: Path) -> Ontology:
    with_bytes(folder, "catalog-v001.xml", b"<catalog")
    return suave_with(folder, "")


def in_another_namespace(folder: Path) -> object:
    (file,) = subject(folder).ontologies
    text = file.read_text(encoding="utf-8").replace(TOMASYS, OTHER_TOMASYS)
    file.write_text(text, encoding="utf-8")
    return Ontology.load([file]).check([SEARCH])


def java_throws(folder: Path) -> Reasoner:
    odd = rule("odd", 'FunctionGrounding(?g) ^ typeFD(?g, "text") -> Role(?g)')
    return Reasoner(suave_with(folder, odd), "pellet")


UNREADABLE: dict[str, tuple[Callable[[Path], object], str]] = {
    "a file that is missing": (lambda at: Ontology.load([at / "none.owl"]), "no such file"),
    "a file in a folder that is missing": (
        lambda at: Ontology.load([at / "none.owl" / "suave.owl"]),
        "no such file",
    ),
    "a folder": (lambda at: Ontology.load([at]), "is a folder"),
    "rules in no UTF-8": (lambda at: with_rules(at, b"\xff\xfe\x00"), "is not UTF-8 text"),
    "rules in XML": (
        lambda at: with_rules(at, b"<?xml version='1.0'?><x/>"),
        "this is XML, not rules as text",
    ),
    "an unknown reasoner": (
        lambda _: Reasoner(Ontology.load(), "hermit"),
        "there is no reasoner 'hermit' (one of cached, owlready2, pellet)",
    ),
}
UNREASONABLE: dict[str, tuple[Callable[[Path], object], str]] = {
    "bytes": (
        lambda at: Ontology.load([with_bytes(at, "bytes.owl", b"\x00\xff\xfe\x01" * 50)]),
        "not text in utf-8",
    ),
    "two versions of an ontology": (two_versions, "supplies the ontology"),
    "a catalog that is no XML": (
        with_a_damaged_catalog,
        "catalog-v001.xml: not well-formed XML",
    ),
    "an unknown operator": (
        lambda at: suave_with(
            at, individual("noise", "QualityAttributeType", ("qa_comparison_operator", "=<"))
        ),
        "qa_comparison_operator '=<' is unknown (one of < <= > >=)",
    ),
    "a name of two designs": (
        lambda at: suave_with(at, individual("mros:fd_spiral_low", "FunctionDesign")),
        "two function designs have this name",
    ),
    "a required value without operator": (
        lambda at: decided(suave_with(at, NOISE), searching(None, 2.5, status="UNGROUNDED")),
        "requires a value of noise, which has no qa_comparison_operator",
    ),
    "another namespace": (
        in_another_namespace,
        f"it uses terms of {OTHER_TOMASYS}, but those of TOMASys are in {TOMASYS}",
    ),
    "half a rule": (lambda at: with_rules(at, b"A: B("), "line 1, column 6"),
    "an ambiguous name": (
        lambda at: suave_with(at, TWINS, "A: Twin(?x) -> Role(?x)"),
        "ambiguous (write http://a.org/#Twin or http://b.org/#Twin)",
    ),
    "a rule to switch off that is not there": (
        lambda _: Ontology.load(disabled_rules=["compEror"]),
        "no rule compEror to switch off (did you mean compError",
    ),
    "an unknown design": (
        lambda _: decided(Ontology.load(), searching("fd_spiral_hgih")),
        "no function design fd_spiral_hgih",
    ),
    "an unknown function": (
        lambda _: decided(Ontology.load(), KnowledgeState.of([ObjectiveState("f_dance")])),
        "no function f_dance",
    ),
    "two objectives of a function": (
        lambda _: KnowledgeState.of([ObjectiveState(SEARCH), ObjectiveState(SEARCH, "UNGROUNDED")]),
        f"{SEARCH} has two objectives",
    ),
    "no number": (lambda _: exact(float("nan")), "number"),
    "an infinite number": (lambda _: exact(float("inf")), "number"),
    "a word for a number": (lambda _: exact("fast"), "number"),
    "a number of too many digits": (lambda _: exact(Decimal("1e100000")), "number"),
    "a rule on which Java throws": (java_throws, "Pellet cannot use the ontologies: "),
    "what Java throws": (java_throws, "literal as an individual"),
}


def refusal(folder: Path, kind: type[InputError], refused: Callable[[Path], object]) -> str:
    """What is said, in one line."""
    with pytest.raises(kind) as error:
        refused(folder)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("given", UNREADABLE)
def test_what_cannot_be_read_is_refused_with_the_reason(tmp_path, given):
    refused, said = UNREADABLE[given]
    assert said in refusal(tmp_path, InputError, refused)


@pytest.mark.parametrize("given", UNREASONABLE)
def test_what_cannot_be_reasoned_with_is_refused_with_the_reason(tmp_path, given):
    refused, said = UNREASONABLE[given]
    assert said in refusal(tmp_path, KnowledgeError, refused)
