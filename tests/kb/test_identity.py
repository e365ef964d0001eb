"""What rules conclude to be the same, or different, is shown and explained."""

from collections.abc import Callable

import pytest

from suave_des.errors import InputError
from suave_des.kb.knowledge_base import KnowledgeBase
from tests.helpers.owl_text import individual

RULE = "R: requiresO(?x, ?y) -> {}(?x, ?y)\n"
LINKED = individual("one", "FunctionGrounding", ("requiresO", ":other")) + individual(
    "other", "Objective"
)


@pytest.fixture(params=["sameAs", "differentFrom"])
def concluded(
    request: pytest.FixtureRequest, suave_copy, tmp_path
) -> tuple[str, tuple[object, ...]]:
    """A conclusion about identity, and the options of the files that conclude it."""
    name, rules = request.param, tmp_path / "own.swrl"
    rules.write_text(RULE.format(name))
    return f"{name}(one, other)", ("--ontology", suave_copy(LINKED), "--rules", rules)


def test_a_conclusion_about_identity_is_shown_once(command, concluded):
    fact, files = concluded
    status, out, _ = command("infer", *files)
    assert status == 0
    name = fact.partition("(")[0]
    assert [line.strip() for line in out.splitlines() if name in line] == [fact]


def test_a_conclusion_about_identity_is_explained(command, concluded):
    fact, files = concluded
    status, out, _ = command("explain", fact, *files)
    assert status == 0
    assert "by rule R with ?x = one, ?y = other" in out


def test_what_the_ontology_says_of_identity_is_no_inference(suave_copy, tmp_path):
    (tmp_path / "own.swrl").write_text(RULE.format("differentFrom"))
    said = LINKED.replace(
        '#FunctionGrounding"/>',
        '#FunctionGrounding"/><owl:differentFrom rdf:resource="http://www.metacontrol.org/suave#other"/>',
    )
    knowledge = KnowledgeBase.load(suave_copy(said), rules=tmp_path / "own.swrl")
    assert knowledge.identities(knowledge.state()) == ()


def test_any_status_can_be_given_where_a_rule_reads_every_one(command, tmp_path):
    (tmp_path / "own.swrl").write_text("R: c_status(?c, ?s) -> Role(?c)\n")
    status, out, _ = command(
        "infer", "--rules", tmp_path / "own.swrl", "--at", "c_thruster_1=BROKEN"
    )
    assert status == 0
    assert "Role(c_thruster_1)" in out


@pytest.fixture(scope="module")
def deep(tmp_path_factory: pytest.TempPathFactory) -> KnowledgeBase:
    """Twenty rules with two premises each, of which each follows from the same two."""
    names = [f"<http://example.org/deep#{side}{n}>" for n in range(21) for side in "ab"]
    steps = "".join(
        f"{side}{n}: {names[2 * n]}(?x) ^ {names[2 * n + 1]}(?x) -> {names[2 * n + 2 + (side == 'b')]}(?x)\n"
        for n in range(20)
        for side in "ab"
    )
    first = f'start: c_status(?x, "FALSE") -> {names[0]}(?x) ^ {names[1]}(?x)\n'
    rules = tmp_path_factory.mktemp("deep") / "own.swrl"
    rules.write_text(first + steps)
    return KnowledgeBase.load(rules=rules)


def test_of_facts_that_follow_from_one_another_each_is_told_once(deep):
    """Told one by one that would be a million lines."""
    explanation = deep.explain(
        deep.state(components={"c_thruster_1": "FALSE"}), "a20(c_thruster_1)"
    )
    assert len(list(explanation.lines())) < 100
    assert "see above" in str(explanation)
    assert len(explanation.facts[0].rules()) == 1 + 20 * 2 - 1


def test_a_fact_of_many_steps_that_does_not_follow_is_told_so(deep):
    with pytest.raises(InputError, match="does not follow"):
        deep.explain(deep.state(), "a20(c_thruster_1)")


@pytest.fixture
def told(command, tmp_path) -> Callable[..., list[str]]:
    """What a command with a rule says of inferences that may change; the rule is named."""

    def run(body: str, *words: str) -> list[str]:
        (tmp_path / "own.swrl").write_text(f"alone: {body} -> Role(c_thruster_3)\n")
        done = command(*words, "--rules", tmp_path / "own.swrl")
        assert done.status == 0
        text = "Pellet's inferences are not the same each time"
        lines = [line for line in (done.out + done.err).splitlines() if text in line]
        assert all("rule alone" in line for line in lines)
        return lines

    return run


ABOUT_NAMES, ABOUT_FACTS = "sameAs(?x, c_thruster_1)", "requiresO(?x, ?y) ^ sameAs(?x, ?y)"


@pytest.mark.parametrize(
    ("body", "warns"),
    [
        ("differentFrom(c_thruster_1, c_thruster_2)", True),
        (ABOUT_NAMES, True),
        (f"Component(?z) ^ {ABOUT_NAMES}", True),
        (ABOUT_FACTS, False),
    ],
)
def test_that_inferences_about_names_alone_may_change_is_told(told, body, warns):
    assert bool(told(body, "why-not", "alone")) is warns


@pytest.mark.parametrize("name", ["check", "infer"])
@pytest.mark.parametrize(("body", "warns"), [(ABOUT_NAMES, True), (ABOUT_FACTS, False)])
def test_each_command_tells_that_inferences_may_change(told, name, body, warns):
    assert bool(told(body, name)) is warns
