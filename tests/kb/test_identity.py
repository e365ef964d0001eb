"""What rules conclude to be the same, or different, is shown and explained."""

import pytest

from suave_des.errors import InputError
from suave_des.kb.knowledge_base import KnowledgeBase
from tests.helpers.owl_text import individual

RULE = "R: requiresO(?x, ?y) -> {}(?x, ?y)\n"
LINKED = individual("one", "FunctionGrounding", ("requiresO", ":other")) + individual(
    "other", "Objective"
)


@pytest.mark.parametrize("name", ["sameAs", "differentFrom"])
def test_a_conclusion_about_identity_is_shown_once_and_explained(
    suave_copy, tmp_path, command, name
):
    (tmp_path / "own.swrl").write_text(RULE.format(name))
    files = ("--ontology", suave_copy(LINKED), "--rules", tmp_path / "own.swrl")
    status, out, _ = command("infer", *files)
    assert status == 0
    assert [line.strip() for line in out.splitlines() if name in line] == [f"{name}(one, other)"]
    status, out, _ = command("explain", f"{name}(one, other)", *files)
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


def test_a_status_that_nothing_reports_and_no_rule_mentions_is_refused(command, tmp_path):
    status, _, said = command("infer", "--at", "c_thruster_1=BROKEN")
    assert status == 2 and "no rule mentions the c_status 'BROKEN'" in said
    (tmp_path / "own.swrl").write_text("R: c_status(?c, ?s) -> Role(?c)\n")
    status, out, _ = command(
        "infer", "--rules", tmp_path / "own.swrl", "--at", "c_thruster_1=BROKEN"
    )
    assert status == 0 and "Role(c_thruster_1)" in out  # it reads any status


def test_of_facts_that_follow_from_one_another_each_is_told_once(tmp_path):
    """Twenty rules with two premises each, of which each follows from the same two: told one by one
    that would be a million lines.
    """
    names = [f"<http://example.org/deep#{side}{n}>" for n in range(21) for side in "ab"]
    steps = "".join(
        f"{side}{n}: {names[2 * n]}(?x) ^ {names[2 * n + 1]}(?x) -> {names[2 * n + 2 + (side == 'b')]}(?x)\n"
        for n in range(20)
        for side in "ab"
    )
    first = f'start: c_status(?x, "FALSE") -> {names[0]}(?x) ^ {names[1]}(?x)\n'
    (tmp_path / "own.swrl").write_text(first + steps)
    knowledge = KnowledgeBase.load(rules=tmp_path / "own.swrl")
    state = knowledge.state(components={"c_thruster_1": "FALSE"})
    explanation = knowledge.explain(state, "a20(c_thruster_1)")
    assert len(list(explanation.lines())) < 100
    assert "see above" in str(explanation)
    assert len(explanation.facts[0].rules()) == 1 + 20 * 2 - 1
    with pytest.raises(InputError, match="does not follow"):
        knowledge.explain(knowledge.state(), "a20(c_thruster_1)")


@pytest.mark.parametrize(
    ("body", "warns"),
    [
        ("differentFrom(c_thruster_1, c_thruster_2)", True),
        ("sameAs(?x, c_thruster_1)", True),
        ("Component(?z) ^ sameAs(?x, c_thruster_1)", True),
        ("requiresO(?x, ?y) ^ sameAs(?x, ?y)", False),
    ],
)
def test_that_inferences_about_names_alone_may_change_is_told(command, tmp_path, body, warns):
    """By each command that shows what Pellet infers; the rule is named."""
    (tmp_path / "own.swrl").write_text(f"alone: {body} -> Role(c_thruster_3)\n")
    told = "Pellet's inferences are not the same each time"
    for words in (["check"], ["infer"], ["why-not", "alone"]):
        done = command(*words, "--rules", tmp_path / "own.swrl")
        lines = [line for line in (done.out + done.err).splitlines() if told in line]
        assert all("rule alone" in line for line in lines)
        assert bool(lines) == warns, words
        assert done.status == 0
