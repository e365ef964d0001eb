"""`--set KEY=VALUE` of the kb commands: values of the scenario, and measured values where a state is described."""

from pathlib import Path

import pytest

from suave_des.kb.knowledge_base import KnowledgeBase

IMPROVES = "revision.metacontrol.improve_when_exceeded"
STATE = ("--at", "f_generate_search_path=fd_spiral_low", "--at", "water_visibility=4")


@pytest.mark.parametrize(("improves", "functions"), [("true", ["f_generate_search_path"]), ("false", [])])
def test_infer_decides_with_the_values_that_are_set(command, improves, functions):
    _, out, _ = command("kb", "infer", *STATE, "--set", f"{IMPROVES}={improves}")
    planned = out.partition("plan\n")[2]
    assert [function for function in functions if function in planned] == functions
    assert functions or planned == "  nothing to adapt\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ("infer",),
        ("explain",),
        ("query", "SELECT ?s WHERE { ?s a owl:Class }"),
        ("why-not",),
        ("policy",),
        ("check",),
        ("rules",),
        ("diff", "suave.owl", "suave.owl"),
        ("test",),
    ],
)
def test_every_command_that_takes_a_scenario_refuses_an_unknown_key(command, arguments):
    status, out, err = command("kb", *arguments, "--set", "mission.time_limt_s=9")
    assert (status, out) == (2, "")
    assert "--set" in err and "did you mean 'time_limit_s'" in err


def test_missions_that_diff_runs_have_the_values_that_are_set(command):
    options = ("--missions", "1", "--quiet", "--max-failed", "0")
    means = []
    for limit_s in (20, 60):
        _, out, _ = command(
            "kb", "diff", "suave.owl", "suave.owl", *options, "--set", f"mission.time_limit_s={limit_s}"
        )
        (row,) = (line for line in out.splitlines() if line.startswith("search time, s"))
        means.append(float(row.split()[3]))
    assert means[0] <= 21.0 < means[1]


def test_tests_that_are_written_cannot_have_values_that_are_set(command):
    status, _, err = command("kb", "test", "--coverage", "--write", "new.yaml", "--set", "knowledge.reasoner=pellet")
    assert status == 2 and "name it with --scenario" in err
    assert not Path("new.yaml").exists()


def test_from_python_values_are_an_argument():
    base = KnowledgeBase.load(values={IMPROVES: False})
    assert KnowledgeBase.load().settings.improves_exceeded and not base.settings.improves_exceeded
