"""Managers that are decision tables: metacontrol's own flies metacontrol's missions, settings do
what they say, and tables that cannot be used are refused before a mission.
"""

import gzip
from pathlib import Path

import pytest

from suave_des.api import run_mission
from suave_des.campaign.campaign import resume_campaign, run_campaign
from suave_des.errors import InputError
from suave_des.kb.decision_table import read_table
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.table_difference import compare_deciders
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.registry import is_built_in

VISIBILITY = "signals.water_visibility"
STEP = {"kind": "step", "time_s": 60.3, "before": 3.25, "after": 1.1, "publishing_period_s": 1.0}
OWN_TABLE = Path(__file__).parents[1] / "data" / "metacontrol_table.csv.gz"
NO_LOAD = {"calibration.reasoning_slowdown": 0}
MISSIONS = {
    "2023": ("seams2023", {"latencies.inference_s": 1.2}),
    "2023, latency beyond a period": ("seams2023", {"latencies.inference_s": 3.1}),
    "2023, no latency, quick changes": (
        "seams2023",
        {
            "latencies.inference_s": 0,
            f"{VISIBILITY}.period_s": 37.3,
            "managers.metacontrol.reasoning_period_s": 0.7,
        },
    ),
    "2023, visibility at a threshold": (
        "seams2023",
        {"latencies.inference_s": 0.5, VISIBILITY: {"kind": "constant", "value": 2.25}},
    ),
    "2023, too dark for any design": (
        "seams2023",
        {"latencies.inference_s": 0.5, VISIBILITY: {"kind": "constant", "value": 1.0}},
    ),
    "1.5": ("release15", {"latencies.inference_s": 1.2, **NO_LOAD}),
    "2025, two failures": ("planta_exp1", {"latencies.inference_s": 0.52, **NO_LOAD}),
    "2025, dark from a threshold": (
        "planta_exp1",
        {"latencies.inference_s": 0.5, VISIBILITY: STEP, **NO_LOAD},
    ),
}


@pytest.fixture(scope="module")
def own_table(tmp_path_factory):
    """Metacontrol's decisions, whatever thrusters report."""
    file = tmp_path_factory.mktemp("table") / "own.csv"
    file.write_bytes(gzip.decompress(OWN_TABLE.read_bytes()))
    return file


@pytest.mark.slow
def test_the_kept_table_is_what_the_policy_says(own_table):
    assert KnowledgeBase.load().policy(max_failed=6).csv() == own_table.read_text()


@pytest.mark.parametrize(("scenario", "values"), MISSIONS.values(), ids=MISSIONS)
def test_metacontrols_own_table_flies_its_missions(scenario, values, own_table):
    both = [
        run_campaign(scenario, [manager], 5, values=values).frame().drop(columns="manager")
        for manager in ("metacontrol", f"table:{own_table}")
    ]
    assert len(both[0]) == 5
    assert both[0].to_csv() == both[1].to_csv()


@pytest.mark.slow
def test_its_table_of_the_extended_mission_too(tmp_path):
    scenario = tmp_path / "unharmed.yaml"
    scenario.write_text("base: extended.yaml\nthruster_events: []\n")
    values = {"latencies.inference_s": 0.6, **NO_LOAD}
    table = tmp_path / "own.csv"
    table.write_text(KnowledgeBase.load(scenario=scenario).policy(max_failed=0).csv())
    both = [
        run_campaign(scenario, [manager], 2, values=values).frame().drop(columns="manager")
        for manager in ("metacontrol", f"table:{table}")
    ]
    assert both[0]["recharges"].sum() > 0
    assert both[0].to_csv() == both[1].to_csv()


SETTINGS = "# latency_s: 0.25\n"
PLAIN = """water_visibility,components,f_generate_search_path_then,f_maintain_motion_then,f_follow_pipeline_then
>= 2.25,any,fd_spiral_medium,,
not measured or < 2.25,any,fd_spiral_low,,
,any,,fd_all_thrusters,fd_follow_pipeline
"""


@pytest.fixture
def table(tmp_path):
    """Writes a table, and returns its manager's name."""

    def write(text, name="table.csv"):
        (tmp_path / name).write_text(text)
        return f"table:{tmp_path / name}"

    return write


def requests(manager, function, scenario="seams2023", **values):
    """When modes of a function were requested, and which."""
    events = run_mission(scenario, manager, 1, 1, values=values).events
    return [
        (each.t_s, each.detail.rpartition(" ")[2])
        for each in events
        if each.event == "mode_requested" and each.detail.startswith(function)
    ]


def test_a_few_rows_are_a_manager(table):
    found = requests(table(SETTINGS + PLAIN), "f_generate_search_path")
    assert {mode for _, mode in found} == {"fd_spiral_medium", "fd_spiral_low", "fd_unground"}
    assert is_built_in(table(PLAIN))  # its decisions are data, which needs no trust


def test_a_decision_takes_its_latency(table):
    quick, slow = (
        requests(
            table(f"# as_metacontrol: false\n# latency_s: {latency_s}\n{PLAIN}"),
            "f_maintain_motion",
        )
        for latency_s in (0.25, 1.0)
    )
    assert slow[0][0] - quick[0][0] == pytest.approx(0.75)


def test_at_events_it_decides_when_a_task_begins(table):
    settings = "# trigger: event\n# as_metacontrol: false\n# latency_s: 0\n"
    events = run_mission("seams2023", table(settings + PLAIN), 1, 1).events
    asked_s = [each.t_s for each in events if each.event == "objective"]
    requested_s = {each.t_s for each in events if each.event == "mode_requested"}
    assert asked_s and set(asked_s) <= requested_s


def test_at_events_it_decides_when_the_visibility_changes(table):
    settings = "# trigger: event\n# as_metacontrol: false\n# latency_s: 0\n"
    step = {"kind": "step", "time_s": 20.0, "before": 3.0, "after": 2.0}
    found = requests(table(settings + PLAIN), "f_generate_search_path", **{f"{VISIBILITY}": step})
    assert [mode for _, mode in found[:3]] == ["fd_spiral_low", "fd_spiral_medium", "fd_spiral_low"]
    assert 20.0 <= found[2][0] <= 20.2


def test_functions_change_one_at_a_time_in_the_order_given(table):
    settings = (
        "# period_s: 0.5\n# latency_s: 0\n# as_metacontrol: false\n# functions_at_a_time: 1\n"
        "# order: [f_maintain_motion]\n"
    )
    manager = table(settings + PLAIN)
    first_s, first = requests(manager, "f_maintain_motion", "release15")[0]
    then_s, then = requests(manager, "f_generate_search_path", "release15")[0]
    assert (first, then) == ("fd_all_thrusters", "fd_spiral_low")
    assert then_s - first_s == pytest.approx(0.5)


BY_STATUS = """# as_metacontrol: false
# latency_s: 0
# forgets_recovered: {forgets}
components,f_generate_search_path_then,f_maintain_motion_then,f_follow_pipeline_then
,,fd_all_thrusters,
{reported}
any,fd_spiral_low,,fd_follow_pipeline
"""


@pytest.mark.parametrize(("forgets", "last"), [("true", "fd_all_thrusters"), ("false", "fd_recover_thrusters")])  # fmt: skip
def test_a_recovered_component_may_be_remembered(table, forgets, last):
    reports = [
        "; ".join(f"c_thruster_{n}={status}" for n, status in enumerate(statuses, 1))
        for count in range(1, 7)
        for statuses in (
            ["FALSE"] * failed + ["RECOVERED"] * (count - failed) for failed in range(count + 1)
        )
    ]
    rows = "\n".join(f"{each},,fd_recover_thrusters," for each in reports)
    manager = table(BY_STATUS.format(forgets=forgets, reported=rows))
    assert requests(manager, "f_maintain_motion")[-1][1] == last


def test_settings_of_a_scenario_count_before_the_tables(table, tmp_path):
    manager = table("# latency_s: 0.25\n# as_metacontrol: false\n" + PLAIN)
    scenario = tmp_path / "slow.yaml"
    scenario.write_text(f"base: seams2023.yaml\nmanagers:\n  '{manager}': {{latency_s: 1.25}}\n")
    motion = "f_maintain_motion"
    quick, slow = requests(manager, motion), requests(manager, motion, scenario)
    assert slow[0][0] - quick[0][0] == pytest.approx(1.0)


def test_the_table_is_an_input_of_its_campaign(table, tmp_path):
    manager = table(PLAIN)
    run_campaign("seams2023", [manager], 1, out=tmp_path / "out")
    table(PLAIN.replace(">= 2.25,any,fd_spiral_medium", ">= 2.25,any,fd_spiral_high"))
    with pytest.raises(InputError, match=r"table\.csv"):
        resume_campaign(tmp_path / "out", runs=2)


def without_row(start):
    return "".join(line for line in PLAIN.splitlines(True) if not line.startswith(start))


UNUSABLE = {
    "gap": (
        without_row("not measured"),
        "no row decides f_generate_search_path where f_generate_search_path now ungrounded, "
        "water_visibility not measured",
    ),
    "gap between rows": (
        PLAIN.replace("not measured or < 2.25", "not measured or < 2"),
        "beside line 3: no row decides f_generate_search_path where f_generate_search_path now "
        "ungrounded, water_visibility 2 (",
    ),
    "overlap": (
        PLAIN.replace("not measured or < 2.25", "not measured or <= 2.25"),
        "line 3: f_generate_search_path: fd_spiral_low here, and fd_spiral_medium in line 2, for one state",
    ),
    "wider row overlaps": (
        PLAIN + ">= 3,c_thruster_1=FALSE,fd_spiral_high,,\n",
        "line 5: f_generate_search_path: fd_spiral_high here, and fd_spiral_medium in line 2",
    ),
    "unknown design": (
        PLAIN.replace("medium", "medum"),
        "line 2: f_generate_search_path has no mode 'fd_spiral_medum' (did you mean 'fd_spiral_medium'?",
    ),
    "unknown function": (
        PLAIN.replace("f_follow_pipeline_then", "f_folow_pipeline_then"),
        "there is no function f_folow_pipeline",
    ),
    "unknown attribute": (PLAIN.replace("water_", "watr_"), "nothing measures watr_visibility"),
    "no column for a function": (
        "f_maintain_motion_then\nfd_all_thrusters\n",
        "no row decides f_generate_search_path (add a column f_generate_search_path_then)",
    ),
    "nan": (PLAIN.replace(">= 2.25", ">= nan"), "line 2, water_visibility"),
    "number that is none": (PLAIN.replace(">= 2.25", "clear"), "line 2, water_visibility"),
    "empty region": (PLAIN.replace(">= 2.25", "3 < . < 2"), "no number is in the region"),
    "no report": (PLAIN.replace(",any,fd_spiral_low", ",broken,fd_spiral_low"), "line 3: components"),
    "no rows": (SETTINGS + PLAIN.splitlines()[0], "line 2: has no rows"),
    "empty": ("", "line 1: no column says what is decided"),
    "nothing decided": (PLAIN + ",any,,,\n", "line 5: decides nothing"),
    "contradiction": (PLAIN.replace("fd_spiral_low", "inconsistent"), "line 3: f_generate_search_path"),
    "cells too few": (PLAIN + "any\n", "line 5: has 1 cells, but there are 5 columns"),
    "column twice": (PLAIN.replace("components", "water_visibility"), "line 1: the column"),
    "not CSV": (PLAIN + '"a"b,,,,\n', "line 5: is not valid CSV"),
    "misspelt setting": ("# perod_s: 1\n" + PLAIN, "line 1, perod_s: unknown key perod_s"),
    "setting that is no number": ("# period_s: .nan\n" + PLAIN, "line 1, period_s"),
    "setting out of order": ("# latency_s: -1\n" + PLAIN, "line 1, latency_s"),
}  # fmt: skip


BY_REPORT = """components,f_generate_search_path_then,f_maintain_motion_then,f_follow_pipeline_then
any,fd_spiral_low,,fd_follow_pipeline
,,fd_all_thrusters,
"""
FAILED = BY_REPORT + "c_thruster_1=FALSE,,fd_recover_thrusters,\n"
BY_OTHER = """f_generate_search_path_now,components,f_generate_search_path_then,f_maintain_motion_then,f_follow_pipeline_then
any,any,fd_spiral_low,,fd_follow_pipeline
fd_spiral_high,any,,fd_all_thrusters,
fd_spiral_low,c_thruster_1=FALSE,,fd_recover_thrusters,
"""
UNUSABLE |= {
    "no row for a report": (
        BY_REPORT,
        "no row decides f_maintain_motion where f_maintain_motion now ungrounded, components "
        "c_thruster_1=FALSE",
    ),
    "no row for a component outside groups": (
        "# interchangeable: []\n" + FAILED,
        "no row decides f_maintain_motion where f_maintain_motion now ungrounded, components "
        "c_thruster_6=RECOVERED",
    ),
    "no row for another function's design": (
        BY_OTHER,
        "no row decides f_maintain_motion where f_maintain_motion now ungrounded, "
        "f_generate_search_path now ungrounded, components without a report",
    ),
    "unknown component": (
        FAILED.replace("thruster_1=", "truster_1="),
        "line 4: there is no component c_truster_1 (did you mean c_thruster_1?",
    ),
    "unknown status": (
        FAILED.replace("=FALSE", "=FALS"),
        "line 4: c_thruster_1 never reports FALS (did you mean FALSE?",
    ),
    "unknown component in a group": (
        "# interchangeable: [[c_thruster_1, c_truster_2]]\n" + PLAIN,
        "line 1, interchangeable: there is no component c_truster_2 (did you mean c_thruster_2?",
    ),
    "component twice in groups": (
        "# interchangeable: [[c_thruster_1], [c_thruster_1]]\n" + PLAIN,
        "line 1, interchangeable: c_thruster_1 is there twice",
    ),
    "unknown function in the order": (
        "# order: [f_maintain_moton]\n" + PLAIN,
        "line 1, order[0]: no column decides a function f_maintain_moton (did you mean f_maintain_motion?",
    ),
    "unknown function requested again": (
        "again,f_maintain_motion_then\nf_maintain_moton,stays\n",
        "line 2: again: no column decides a function f_maintain_moton (did you mean f_maintain_motion?",
    ),
    "no function at a time": (
        "# functions_at_a_time: 0\n" + PLAIN,
        "line 1, functions_at_a_time: 0 functions cannot change (write 1 or more; leave it out for all",
    ),
    "note among settings": (
        "# a table of mine\n" + SETTINGS + PLAIN,
        "lines that begin with # are settings, such as # latency_s: 0.2; a note is # # note",
    ),
    "semicolons": (PLAIN.replace(",", ";"), "line 1: the header has one column (write commas"),
    "tabs": (PLAIN.replace(",", "\t"), "line 1: the header has one column (write commas"),
    "unknown ending": (
        PLAIN.replace("water_visibility", "f_follow_pipeline_nwo"),
        "nor does it end in _now or _then (did you mean f_follow_pipeline_now?",
    ),
    "word in capitals": (PLAIN.replace("fd_spiral_low", "Stays"), "(did you mean stays?"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "said"), UNUSABLE.values(), ids=UNUSABLE)
def test_a_table_that_cannot_be_used_is_refused_before_any_mission(text, said, table):
    manager = table(text)
    with pytest.raises(InputError) as raised:
        run_campaign("seams2023", [manager], 1)
    assert said.replace("'", "") in str(raised.value).replace("'", "")
    assert manager.removeprefix("table:") in str(raised.value)


def test_rows_that_decide_alike_may_overlap(table):
    wider = PLAIN + ">= 3,c_thruster_1=FALSE,fd_spiral_medium,,\n"
    assert read_table(Path(table(wider).removeprefix("table:"))).designs


def test_a_table_for_fewer_reports_than_a_mission_can_have_is_refused(own_table, table):
    few = [line for line in own_table.read_text().splitlines(True) if line.count("c_thruster") < 3]
    with pytest.raises(InputError, match="--max-failed 6"):
        run_campaign("seams2023", [table("".join(few))], 1)


def decided(file, now, **components):
    """What becomes of f_maintain_motion while the search has a design, and by which line."""
    objectives = [ObjectiveState("f_maintain_motion"), ObjectiveState("f_generate_search_path")]
    state = KnowledgeState.of(
        objectives, groundings={"f_generate_search_path": now}, components=components
    )
    return read_table(file).rule("f_maintain_motion", state)


def test_a_row_decides_where_a_narrower_one_asks_for_another_functions_design(table):
    file = Path(table(BY_OTHER).removeprefix("table:"))
    assert decided(file, "fd_spiral_high", c_thruster_1="FALSE") == ("fd_all_thrusters", 3)
    assert decided(file, "fd_spiral_low", c_thruster_4="FALSE") == ("fd_recover_thrusters", 4)
    with pytest.raises(InputError, match="f_generate_search_path now fd_spiral_medium"):
        decided(file, "fd_spiral_medium", c_thruster_1="FALSE")


def test_blank_lines_among_settings_are_skipped(table):
    file = Path(table(f"# latency_s: 0.25\n\n# period_s: 2\n\n{PLAIN}").removeprefix("table:"))
    settings = read_table(file).settings
    assert (settings.latency_s, settings.period_s) == (0.25, 2.0)


def test_a_comparison_says_which_states_a_table_has_to_decide(table):
    file = Path(
        table(PLAIN.replace(",any,fd_spiral_medium", ",,fd_spiral_medium")).removeprefix("table:")
    )
    base = KnowledgeBase.load()
    with pytest.raises(InputError, match="all designs of the ontology as now"):
        compare_deciders(base, [base, read_table(file)], 1, lambda *_: None)
