"""What changes no mission is told: by campaigns, for swept values too, and by kb check."""

from __future__ import annotations

from pathlib import Path

import pytest

from suave_des.campaign.campaign import run_campaign
from suave_des.scenario.loader import load_scenario, with_values
from tests.helpers.command import command_here

EARLY = "thruster_events.0: failures have no effect before 26 s"


def failures(*times_s: object) -> dict[str, object]:
    return {"thruster_events": [{"thruster": 1, "event": "failure", "time_s": time_s} for time_s in times_s]}


@pytest.mark.parametrize(
    ("values", "starts"),
    [
        (failures(35.0), []),
        (failures(25.5), []),  # the monitor may notice it at 26 s only
        (failures(10.0), [EARLY]),
        (failures(10.0, 15.0), [EARLY]),  # in 2023 the second is 15 s later
        (failures({"distribution": "uniform", "minimum": 5, "maximum": 20}), [EARLY]),
        (failures({"distribution": "uniform", "minimum": 5, "maximum": 60}), []),
        (failures(100.0, 250.0), ["thruster_events.1: 350 s is after the end"]),  # in 2023 it counts from the first
        (failures(100.0, 250.0) | {"revision.monitors.thruster_event_times": "after_start"}, []),
        (failures(100.0) | {"mission.time_limit_s": 100.0}, ["thruster_events.0: 100 s is after the end"]),
        ({"leak": {"time_s": 301.0}}, ["leak: 301 s is after the end"]),
        (
            {"signals.water_visibility": {"kind": "step", "time_s": 500.0, "before": 1.0, "after": 2.0}},
            ["signals.water_visibility: 500 s is after the end"],
        ),
    ],
)
def test_what_comes_too_early_or_too_late(values, starts) -> None:
    loaded = load_scenario("extended" if "leak" in values else "seams2023")
    found = list(with_values(loaded, values).scenario.without_effect())
    assert len(found) == len(starts)
    assert all(one.startswith(start) for one, start in zip(found, starts, strict=True)), found


@pytest.mark.parametrize("name", ["seams2023", "release15", "planta_exp1", "extended"])
def test_all_of_the_shipped_scenarios_has_an_effect(name: str) -> None:
    assert not list(load_scenario(name).scenario.without_effect())


def test_a_campaign_tells_for_how_many_swept_values(caplog: pytest.LogCaptureFixture) -> None:
    run_campaign("seams2023", ["none"], runs=1, sweep={"thruster_events.0.time_s": [10.0, 20.0, 31.0]})
    (message,) = [each for each in caplog.messages if "no effect" in each]
    assert message.startswith(f"note: {EARLY}") and message.endswith(", at 2 of 3 swept values")


def test_kb_check_warns(tmp_path: Path) -> None:
    done = command_here("kb", "check", "--set", "thruster_events=['(1,failure,10)']", cwd=tmp_path)
    assert done.returncode == 0
    assert f"WARN   shipped/scenarios/seams2023.yaml: {EARLY}" in done.stdout
