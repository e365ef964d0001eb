"""ROSA and PLANTA: the shipped tables decide as their models do, in every region."""

import itertools
from dataclasses import dataclass

import pytest

from suave_des.api import run_mission
from suave_des.kb.decision_table import find_table
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator

SEARCH, FOLLOW, MOTION = "f_generate_search_path", "f_follow_pipeline", "f_maintain_motion"
HIGH, MEDIUM, LOW = "fd_spiral_high", "fd_spiral_medium", "fd_spiral_low"
ALL, RECOVER = "fd_all_thrusters", "fd_recover_thrusters"
UNGROUNDED, STAYS, NONE_LEFT = "ungrounded", "stays", "none left"
THRUSTERS = [f"c_thruster_{number}" for number in range(1, 7)]
BATTERY = [None, 0.1, 0.25, 1.0]

#: By manager and measured visibility: what becomes of ungrounded, high, medium and low.
SEARCHES = {
    "rosa": {
        None: (HIGH, STAYS, HIGH, HIGH),
        0.0: (NONE_LEFT,) * 4,
        1.2499: (NONE_LEFT,) * 4,
        1.25: (LOW, LOW, LOW, STAYS),
        2.2499: (LOW, LOW, LOW, STAYS),
        2.25: (MEDIUM, MEDIUM, STAYS, MEDIUM),
        3.2499: (MEDIUM, MEDIUM, STAYS, MEDIUM),
        3.25: (HIGH, STAYS, HIGH, HIGH),
        9.0: (HIGH, STAYS, HIGH, HIGH),
    },
    "planta": {  # rounded to two decimals; it does not climb while nothing is violated
        None: (HIGH, STAYS, STAYS, STAYS),
        0.0: (NONE_LEFT,) * 4,
        1.2449: (NONE_LEFT,) * 4,
        1.245: (LOW, LOW, LOW, STAYS),
        2.2449: (LOW, LOW, LOW, STAYS),
        2.245: (MEDIUM, MEDIUM, STAYS, STAYS),
        3.2449: (MEDIUM, MEDIUM, STAYS, STAYS),
        3.245: (HIGH, STAYS, STAYS, STAYS),
        9.0: (HIGH, STAYS, STAYS, STAYS),
    },
}
#: By manager and thrusters: what becomes of ungrounded, all and recover.
MOTIONS = {
    "rosa": {
        "fine": (ALL, STAYS, ALL),
        "failed": (RECOVER, RECOVER, STAYS),
        "recovered": (ALL, STAYS, ALL),
    },
    "planta": {  # it waits for OK, and recovered thrusters are RECOVERED
        "fine": (ALL, STAYS, STAYS),
        "failed": (RECOVER, RECOVER, STAYS),
        "recovered": (RECOVER, RECOVER, STAYS),
    },
}


@dataclass(frozen=True)
class Case:
    measured: dict[str, float]
    components: dict[str, str]
    now: dict[str, str]
    then: dict[str, str]


def reported():
    """All that thrusters can report, up to an exchange, on thrusters from another one on; with
    its kind.
    """
    for failed, recovered in itertools.product(range(7), repeat=2):
        if failed + recovered <= 6:
            first = (failed + recovered) % 6
            names = itertools.islice(itertools.cycle(THRUSTERS), first, None)
            statuses = ["RECOVERED"] * recovered + ["FALSE"] * failed
            kind = "fine" if not statuses else "failed" if failed else "recovered"
            yield dict(zip(names, statuses, strict=False)), kind


def cases(manager):
    """Every region: visibility x thrusters x tasks x designs in use x battery."""
    follow = {UNGROUNDED: "fd_follow_pipeline", "fd_follow_pipeline": STAYS}
    for (visibility_m, searches), (components, kind), battery in itertools.product(
        SEARCHES[manager].items(), reported(), BATTERY
    ):
        motions = dict(zip((UNGROUNDED, ALL, RECOVER), MOTIONS[manager][kind], strict=True))
        search = dict(zip((UNGROUNDED, HIGH, MEDIUM, LOW), searches, strict=True))
        measured = {"water_visibility": visibility_m, "battery_level": battery}
        for task, by_now in ((SEARCH, search), (FOLLOW, follow)):
            for motion, now in itertools.product(motions, by_now):
                yield Case(
                    {name: value for name, value in measured.items() if value is not None},
                    components,
                    {MOTION: motion, task: now},
                    {MOTION: motions[motion], task: by_now[now]},
                )


@pytest.mark.parametrize("manager", ["rosa", "planta"])
def test_the_table_decides_as_the_model_in_every_region(manager):
    table, every = find_table(manager), list(cases(manager))
    assert len(every) == 9 * 28 * 4 * 18
    for case in every:
        state = KnowledgeState.of(
            [ObjectiveState(name) for name in case.now],
            groundings={name: each for name, each in case.now.items() if each != UNGROUNDED},
            components=case.components,
            measurements=case.measured,
        )
        assert {name: table.rule(name, state)[0] for name in case.now} == case.then, case


def test_rosas_program_writes_the_shipped_table():
    from managers import rosa

    assert rosa.text() == find_table("rosa").path.read_text()


@pytest.mark.slow
def test_fast_downward_plans_the_shipped_table_of_planta():
    from managers import planta

    pytest.importorskip("up_fast_downward")
    assert planta.text() == find_table("planta").path.read_text()


def test_planta_is_planned_by_fast_downward():
    from managers import planta
    from managers.exemplar import State

    pytest.importorskip("up_fast_downward")
    state = State("fd_spiral_medium", "failed", {MOTION: ALL, SEARCH: HIGH})
    assert planta.decide(state) == {MOTION: RECOVER, SEARCH: MEDIUM}


@pytest.mark.parametrize("manager", ["rosa", "planta"])
@pytest.mark.parametrize("scenario", ["seams2023", "release15", "planta_exp1"])
def test_it_flies_the_shipped_scenarios(manager, scenario):
    metrics = Simulator(load_scenario(scenario)).run(manager, 1, 1).metrics
    assert metrics.pipeline_found and metrics.adaptations > 0


def test_planta_reconfigures_one_function_in_half_a_second():
    events = run_mission("planta_exp1", "planta", 1, 1).events
    requested = [each for each in events if each.event == "mode_requested"]
    assert requested[1].t_s - requested[0].t_s == pytest.approx(0.5)


@pytest.mark.parametrize(("manager", "mode"), [("planta", RECOVER), ("rosa", ALL)])
def test_planta_alone_leaves_recovered_thrusters_in_recovery(manager, mode):
    events = run_mission("planta_exp1", manager, 1, 1).events
    details = [each.detail for each in events if each.event == "mode_requested"]
    assert f"{MOTION} -> {RECOVER}" in details
    in_use = [each for each in details if MOTION in each and not each.endswith("fd_unground")]
    assert in_use[-1] == f"{MOTION} -> {mode}"
