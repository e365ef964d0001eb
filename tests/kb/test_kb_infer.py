"""kb infer and kb query: states as people write them, what follows, the time limit, and SPARQL over
all of it.
"""

import csv
import io
import json
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest

from suave_des import run_mission
from suave_des.errors import KnowledgeError
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.knowledge import pellet as limit
from suave_des.knowledge.pellet import TimeLimit, times_abandoned
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import ContradictionError, ObjectiveState
from tests.helpers.command import command_here, python

HIGH = {
    "groundings": {"f_generate_search_path": "fd_spiral_high"},
    "measurements": {"water_visibility": 1.8},
}
_BODY = " ^ ".join(f"isQAtype(?a{n}, ?b{n})" for n in range(12))
EXPLOSION = f"explosion: {_BODY} -> o_updatable(o_generate_search_path, true)\n"


def test_an_error_is_inferred(knowledge):
    facts = knowledge.infer(knowledge.state(**HIGH)).inference.facts
    assert "fg_status(fg_spiral_high, IN_ERROR_NFR)" in set(map(str, facts))


def test_a_lower_spiral_is_planned(knowledge):
    plan = knowledge.infer(knowledge.state(**HIGH)).plan
    assert [(each.function, each.design) for each in plan.decisions] == [
        ("f_generate_search_path", "fd_spiral_low")
    ]


@pytest.fixture(scope="module")
def in_murky_water(tmp_path_factory):
    """The words for a state, in whose cycle the visibility falls below 3.25 m, after its beginning."""
    folder = tmp_path_factory.mktemp("missions") / "flown"
    run_mission("seams2023", "metacontrol", 1, 1, folder)
    return f"{folder}@12"


def inferred_at(folder: Path, *words: str) -> str:
    given = (part for word in words for part in ("--at", word))
    return command_here("kb", "infer", *given, cwd=folder).stdout


def test_a_recorded_state_is_planned_with_the_values_of_its_mission(tmp_path, in_murky_water):
    printed = inferred_at(tmp_path, in_murky_water)
    assert "measured    water_visibility = 3.31" in printed
    assert "planned by  water_visibility = 3.23" in printed
    assert "f_generate_search_path: fd_spiral_medium" in printed


def test_a_value_given_beside_a_recorded_state_counts_for_both(tmp_path, in_murky_water):
    printed = inferred_at(tmp_path, in_murky_water, "water_visibility=3.3")
    assert "planned by" not in printed
    assert "f_generate_search_path: fd_spiral_high stays" in printed


def test_without_objectives_the_search_task_s_are_asked_for(knowledge):
    assert knowledge.state().objectives == (
        ObjectiveState("f_generate_search_path", "UNGROUNDED"),
        ObjectiveState("f_maintain_motion", "UNGROUNDED"),
    )


@pytest.fixture
def state_file(tmp_path) -> Path:
    file = tmp_path / "state.yaml"
    file.write_text(
        "objectives: [f_generate_search_path]\n"
        "groundings: {f_generate_search_path: fd_spiral_high}\n"
        "components: {c_thruster_1: FALSE}\n"  # YAML's own false
        "measurements: {water_visibility: 1.8}\n"
    )
    return file


def test_the_false_of_yaml_is_a_status_like_any_other(knowledge, state_file):
    assert knowledge.state(state_file).components == (("c_thruster_1", "FALSE"),)


def test_words_win_over_the_file_that_they_complete(knowledge, state_file):
    words = {"water_visibility": 3.0}, {"c_thruster_1": "RECOVERED"}
    state = knowledge.state(state_file, measurements=words[0], components=words[1])
    assert str(dict(state.measurements)["water_visibility"]) == "3"
    assert state.components == (("c_thruster_1", "RECOVERED"),)


def test_one_file_or_name_may_stand_alone(knowledge, tmp_path):
    (tmp_path / "mine.swrl").write_text("mine: Objective(?o) -> o_updatable(?o, true)\n")
    alone = KnowledgeBase.load(
        "suave.owl", rules=tmp_path / "mine.swrl", disabled_rules="compError"
    )
    assert {
        rule.name: rule.enabled for rule in alone.base.rules if rule.name in ("mine", "compError")
    } == {
        "mine": True,
        "compError": False,
    }
    assert [
        each.function for each in knowledge.state(objectives="f_maintain_motion").objectives
    ] == ["f_maintain_motion"]


def test_a_component_without_a_status_is_shown_with_no_text(knowledge):
    state = knowledge.state(components={"c_thruster_1": ""})
    assert str(state).endswith('c_thruster_1 = ""')


def test_a_contradiction_shows_no_text_as_such(tmp_path):
    # Pellet itself writes "()".
    rules = tmp_path / "empty.swrl"
    rules.write_text('empty: c_status(?c, ?s) ^ equal(?s, "") -> o_status(o_maintain_motion, ?s)\n')
    knowledge = KnowledgeBase.load(rules=rules, reasoner="pellet")
    with pytest.raises(
        ContradictionError, match=r'literal value ""\^\^string .* c_status\(c_thruster_1, ""\)'
    ):
        knowledge.infer(
            knowledge.state(objectives="f_generate_search_path", components={"c_thruster_1": ""})
        )


class TestTimeLimit:
    @pytest.fixture
    def given_up(self, knowledge, monkeypatch) -> Iterator[tuple[Reasoner, KnowledgeError]]:
        """A reasoner that takes too long for a state, and what is told of it."""
        monkeypatch.setattr("suave_des.knowledge.pellet._abandoned", [])
        released = threading.Event()
        monkeypatch.setattr(
            "suave_des.knowledge.pellet.in_process.InProcessPellet.infer",
            lambda *_: released.wait(60.0),
        )
        limit = TimeLimit()
        reasoner = Reasoner(knowledge.base, "pellet", limit)
        limit.seconds = 0.05
        with pytest.raises(KnowledgeError) as error:
            reasoner.analyze(knowledge.state(**HIGH))
        yield reasoner, error.value
        released.set()

    def test_names_the_state_that_takes_too_long(self, given_up):
        _, error = given_up
        assert "fd_spiral_high, water_visibility = 1.8: not done after " in str(error)

    def test_names_what_the_reasoner_still_does_when_it_refuses_more(self, given_up, knowledge):
        reasoner, _ = given_up
        with pytest.raises(KnowledgeError, match="still reasoning"):
            reasoner.analyze(knowledge.state())

    @pytest.mark.parametrize("reasoner", ["cached", "owlready2"])
    def test_holds_for_a_mission_too(self, tmp_path, reasoner):
        rules = tmp_path / "explosion.swrl"
        rules.write_text(EXPLOSION)
        program = f"""
import sys
from suave_des.knowledge import pellet as limit
from suave_des.knowledge.pellet import stock
limit.TimeLimit.__init__.__defaults__ = (1.0, None)
if {reasoner == "owlready2"}:  # its own limit, without the check by the Pellet in this process
    from suave_des.knowledge.pellet import in_process
    in_process.InProcessPellet.__init__ = lambda self, *_: None
from suave_des.cli.main import main
main(["run", "seams2023", "--reasoner", {reasoner!r}, "--rules", {str(rules)!r}])
"""
        done = python("-c", program)
        assert (done.returncode, done.stdout) == (2, "")
        assert "reasoning on the state" in done.stderr
        assert "not done after 1 s" in done.stderr
        assert done.stderr.count("\n") == 1

    def test_who_is_interrupted_while_it_lasts_has_given_it_up(self, monkeypatch):
        # Java may still run then, and crashes in a process that ends as usual.
        def interrupted(*_):
            raise KeyboardInterrupt

        monkeypatch.setattr("suave_des.knowledge.pellet._abandoned", [])
        monkeypatch.setattr("suave_des.knowledge.pellet.wait", interrupted)
        with pytest.raises(KeyboardInterrupt):
            TimeLimit().run(lambda: time.sleep(0.5), "reasoning")
        assert times_abandoned() == 1

    @pytest.mark.parametrize("given_up_on", [False, True])
    def test_a_program_ends_with_its_own_status_whatever_java_does(self, given_up_on):
        program = f"""
import sys
from suave_des.errors import KnowledgeError
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.knowledge import pellet as limit
from suave_des.knowledge.pellet import TimeLimit, times_abandoned
from suave_des.knowledge.state import ContradictionError
knowledge = KnowledgeBase.load(reasoner="pellet")  # Java starts in another thread than this one
state = knowledge.state(groundings={HIGH["groundings"]!r}, measurements={HIGH["measurements"]!r})
assert knowledge.infer(state).plan.decisions
def for_ever():
    while True:
        knowledge.explain(state)
try:
    {given_up_on} and TimeLimit(0.5).run(for_ever, "explaining")
except KnowledgeError:
    pass
sys.exit(5)
"""
        done = python("-c", program)
        assert (done.returncode, done.stderr) == (5, "")

    def test_a_reasoner_that_starts_while_the_process_ends_does_nothing(self, monkeypatch):
        # Its thread is listed from before it runs: abandoned work may be starting another reasoner.
        starting, done = limit._ReasonerThread(), []
        monkeypatch.setattr("suave_des.knowledge.pellet.threading.enumerate", lambda: [starting])
        limit._end_all()
        starting.jobs.put((Future(), lambda: done.append("reasoned")))
        starting.start()
        starting.join(10.0)
        assert not starting.is_alive() and not done

    @pytest.mark.parametrize("is_over", [False, True])
    def test_nobody_waits_for_work_that_comes_after_the_end(self, is_over):
        thread, late = limit._ReasonerThread(), Future()
        thread.jobs.put(None)
        if is_over:
            thread.start()
            thread.join(10.0)
        thread.submit(late, lambda: None)
        if not is_over:
            thread.start()
        assert isinstance(late.exception(10.0), SystemExit)

    def test_abandoned_work_no_longer_calls_java_when_java_ends(self):
        # A call that returns at that very moment keeps Python's lock for ever, and the process
        # never ends.
        program = """
import atexit, sys, threading
from suave_des.errors import KnowledgeError
from suave_des.knowledge.pellet import in_process as java
from suave_des.knowledge.pellet import TimeLimit
thread = java.java_class("java.lang.Thread")
atexit.register(lambda: print([each.name for each in threading.enumerate() if each.name == "reasoner"]))
inner = TimeLimit()  # as a reasoner has its own limit
def for_ever():
    while True:
        inner.run(lambda: thread.sleep(20), "sleeping")
try:
    TimeLimit(0.1).run(for_ever, "sleeping")
except KnowledgeError:
    sys.exit(5)
"""
        done = python("-c", program)
        assert (done.returncode, done.stdout, done.stderr) == (5, "[]\n", "")


SEARCH = "f_generate_search_path"


def test_inferred_facts_are_there_when_asked_for(knowledge):
    state = knowledge.state(
        groundings={SEARCH: "fd_spiral_high"}, measurements={"water_visibility": 1.8}
    )
    query = "SELECT ?g ?s WHERE { ?g tomasys:fg_status ?s }"
    assert knowledge.query(query, state).rows == ()
    assert knowledge.query(query, state, inferred=True).rows == (
        ("suave:fg_spiral_high", "IN_ERROR_NFR"),
    )
    assert knowledge.query(
        "ASK { suave:fg_spiral_high a tomasys:FunctionGrounding }", state
    ).rows == (("true",),)
    assert knowledge.query("ASK { suave:fg_spiral_high a tomasys:FunctionGrounding }").rows == (
        ("false",),
    )


def test_answers_are_the_same_each_time():
    queries = (
        "SELECT ?s ?o WHERE { ?s ?p ?o } LIMIT 9",
        "SELECT ?s ?o WHERE { ?s owl:unionOf ?o }",
    )
    first, second = (
        [KnowledgeBase.load().query(query).rows for query in queries] for _ in range(2)
    )
    assert first == second
    assert all(first)


@pytest.mark.parametrize(
    ("query", "notes"),
    [
        (
            "SELECT ?d WHERE { ?d tomasys:solvsF ?f }",
            ["tomasys:solvsF (did you mean tomasys:solvesF?)"],
        ),
        (
            "ASK { ?d a tomasys:FunctionDesing }",
            ["tomasys:FunctionDesing (did you mean tomasys:FunctionDesign?)"],
        ),
        (
            "ASK { ?g suave:fg_status 1 FILTER NOT EXISTS { suave:f_x a ?c } }",
            ["suave:f_x", "suave:fg_status"],
        ),
        (
            "SELECT ?d WHERE { ?d tomasys:solvesF/tomasys:fg_stat ?f }",
            ["tomasys:fg_stat (did you mean tomasys:fg_status?)"],
        ),
        ("SELECT ?d WHERE { ?d a tomasys:Wrench }", ["tomasys:Wrench"]),
        (
            "SELECT ?d WHERE { ?d tomasys:solvesF ?f . ?d rdfs:seeAlso 2 . ?f a suave:fd_spiral_low. }",
            [],
        ),
    ],
)
def test_names_that_the_knowledge_base_does_not_have_are_noted(knowledge, query, notes):
    noted = knowledge.query(query).unknown
    assert len(noted) == len(notes)
    assert all(one.startswith(begin) for one, begin in zip(noted, notes, strict=True))


def test_the_command_notes_unknown_names_on_its_error_stream(command):
    status, answer, noted = command("query", "SELECT ?d WHERE { ?d tomasys:solvsF ?f }")
    assert (status, answer) == (0, "d\nno rows\n")
    assert (
        noted
        == "suave-des: the knowledge base does not have tomasys:solvsF (did you mean tomasys:solvesF?)\n"
    )


def test_the_command_prints_tables(command):
    words = ("query", "SELECT ?g ?s WHERE { ?g tomasys:fg_status ?s }", "--inferred")
    state = ("--at", f"{SEARCH}=fd_spiral_high", "--at", "water_visibility=1.8")
    status, text, _ = command(*words, *state)
    assert status == 0
    assert text.splitlines()[1].split() == ["suave:fg_spiral_high", "IN_ERROR_NFR"]
    _, text, _ = command(*words, *state, "--format", "csv")
    assert list(csv.DictReader(io.StringIO(text))) == [
        {"g": "suave:fg_spiral_high", "s": "IN_ERROR_NFR"}
    ]
    _, text, _ = command(*words, "--format", "json")
    assert json.loads(text) == []
