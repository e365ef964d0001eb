"""Calibration of several scenarios at once, and of campaign files condition by condition."""

import json
from pathlib import Path

import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.calibration.cases import Case, read_cases
from suave_des.calibration.fit import fit
from suave_des.calibration.loss import (
    SCALES,
    FreeParameter,
    Problem,
    as_vectors,
    compare,
    energy_distance,
    evaluate,
    resampling_spread,
    runs_for_each,
    simulate,
)
from suave_des.calibration.parameters import read_parameters, read_problem
from suave_des.cli.main import main
from suave_des.errors import InputError
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario, value_at, with_values
from suave_des.simulation.simulator import Simulator
from suave_des.validation.shares import Share

JERK, START = "calibration.jerk_m_per_s3", "latencies.search_start_s"
ORIGIN = "calibration.origin_y_m"
BOTH = ["seams2023", "planta_exp1_campaign.yaml"]
SCENARIOS = {name: load_scenario(name) for name in ("seams2023", "planta_exp1")}
CONDITIONS = {1: {"start.y_m": 2.455}, 2: {"start.y_m": 2.963}}


def planted(name: str, values: dict, conditions: dict) -> Case:
    """A case whose real missions are simulated with other values."""
    real = [
        simulate(Simulator(with_values(SCENARIOS[name], {**values, **condition})), "none", 8, 99)
        for condition in conditions.values()
    ]
    numbered = [frame.assign(condition=number) for number, frame in zip(conditions, real, strict=True)]
    return Case(name, SCENARIOS[name], pandas.concat(numbered, ignore_index=True), conditions, base=name)


def test_a_joint_fit_finds_what_was_planted() -> None:
    cases = (
        planted("seams2023", {ORIGIN: -0.2}, {1: {}}),
        planted("planta_exp1", {ORIGIN: -0.2}, CONDITIONS),
    )
    tried = fit(Problem(cases, (FreeParameter(ORIGIN, -0.5, 0.3, 0.0),), 8, 1), 20, workers=1, seed=1)
    assert min(tried, key=lambda each: each.loss).values[0] == pytest.approx(-0.2, abs=0.09)


def test_a_parameter_of_one_scenario_alone_changes_that_one_alone() -> None:
    cases = planted("seams2023", {ORIGIN: -0.3}, {1: {}}), planted("planta_exp1", {ORIGIN: 0.15}, CONDITIONS)
    free = tuple(FreeParameter(ORIGIN, -0.5, 0.3, 0.0, (case.name,)) for case in cases)
    problem = Problem(cases, free, 8, 1)
    right, first, both = (evaluate(problem, values) for values in ([-0.3, 0.15], [0.15, 0.15], [0.15, -0.3]))
    assert right.loss < first.loss < both.loss
    assert right.cases[1] == first.cases[1] != both.cases[1]
    assert right.cases[0] != first.cases[0] == both.cases[0]


def test_the_loss_is_the_mean_of_the_scenarios_losses_alone() -> None:
    cases = planted("seams2023", {}, {1: {}}), planted("planta_exp1", {}, CONDITIONS)
    free = FreeParameter(JERK, 0.3, 1.0, 0.5)
    together = evaluate(Problem(cases, (free,), 4, 1), [0.7])
    alone = [evaluate(Problem((case,), (free,), 4, 1), [0.7]).loss for case in cases]
    assert [each.loss for each in together.cases] == alone
    assert together.loss == pytest.approx(sum(alone) / 2.0)


def missions(rng: np.random.Generator, shifts: dict[int, float], n: int) -> pandas.DataFrame:
    frames = [
        pandas.DataFrame(rng.normal(100.0 + shift, 5.0, (n, 3)), columns=list(SCALES)).assign(
            manager="none", condition=number
        )
        for number, shift in shifts.items()
    ]
    return pandas.concat(frames, ignore_index=True)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000), shift=st.floats(-500.0, 500.0))
def test_what_differs_between_conditions_on_both_sides_alike_counts_for_nothing(seed: int, shift: float) -> None:
    losses = []
    for apart in (0.0, shift):
        rng = np.random.default_rng(seed)
        shifts = {1: 0.0, 2: apart}
        real, simulated = missions(rng, shifts, 5), missions(rng, shifts, 7)
        losses.append(compare(Case("any", SCENARIOS["seams2023"], real, CONDITIONS), simulated).loss)
    assert losses[0] == pytest.approx(losses[1], rel=1e-6, abs=1e-9)


def test_missions_of_swapped_conditions_are_far_though_together_they_are_alike() -> None:
    real = missions(np.random.default_rng(1), {1: 0.0, 2: 80.0}, 6)
    swapped = real.assign(condition=3 - real["condition"])
    case = Case("any", SCENARIOS["seams2023"], real, CONDITIONS)
    assert energy_distance(as_vectors(real), as_vectors(swapped)) == pytest.approx(0.0, abs=1e-9)
    assert compare(case, real).loss == pytest.approx(0.0, abs=1e-9)
    assert compare(case, swapped).loss > 1.0


def test_shares_are_counted_in_the_real_missions_proportions_of_conditions() -> None:
    late = Share(manager="none", name="late", where={"search_time_s": ((150.0, 300.0),)})
    rng = np.random.default_rng(1)
    real = pandas.concat([missions(rng, {1: 0.0}, 9), missions(rng, {2: 100.0}, 3)], ignore_index=True)
    case = Case("any", SCENARIOS["seams2023"], real, CONDITIONS, ((late, 0.25),))
    assert compare(case, missions(rng, {1: 0.0, 2: 100.0}, 12)).share_difference == pytest.approx(0.0, abs=1e-9)


def test_runs_are_shared_among_the_conditions_and_are_at_least_two_under_each() -> None:
    frame = missions(np.random.default_rng(1), {1: 0.0, 2: 0.0}, 2)
    plain = Case("any", SCENARIOS["seams2023"], frame.assign(condition=1))
    under = Case("any", SCENARIOS["planta_exp1"], frame, CONDITIONS)
    assert [runs_for_each(Problem((case,), (), 9, 1), case) for case in (plain, under)] == [9, 5]
    assert runs_for_each(Problem((under,), (), 2, 1), under) == 2


def test_one_real_mission_under_each_condition_has_no_spread() -> None:
    case = planted("planta_exp1", {}, CONDITIONS)
    case = Case(case.name, case.loaded, case.real.groupby("condition").head(1), CONDITIONS)
    problem = Problem((case,), (FreeParameter(JERK, 0.3, 1.0, 0.5),), 2, 1)
    assert resampling_spread(problem, evaluate(problem, [0.5]), 1) == 0.0


def test_each_shipped_scenario_comes_with_its_published_runs_and_a_campaign_with_its_conditions() -> None:
    seams, planta = read_cases(BOTH)
    assert (seams.name, list(seams.digests), len(seams.real)) == ("seams2023", ["seams2023_runs.csv"], 60)
    assert (planta.name, list(planta.digests), len(planta.real)) == ("planta_exp1", ["planta_exp1_runs.csv"], 120)
    assert planta.managers == ("bt", "metacontrol", "none", "random")
    assert seams.conditions == {1: {}} and seams.shares and not seams.has_conditions
    assert planta.has_conditions and list(planta.conditions) == [1, 2, 3, 4, 5, 6]
    assert planta.conditions[6]["thruster_events.1.time_s"] == 24.82


def test_some_conditions_alone_have_their_own_missions_alone() -> None:
    planta = read_cases(BOTH)[1].only([2, 5])
    assert list(planta.conditions) == [2, 5] == sorted(set(planta.real["condition"]))
    assert len(planta.real) == 40


def test_shipped_shared_parameters_are_in_the_shipped_scenarios() -> None:
    problem = read_problem(shipped_folder("scenarios/calibration") / "shared.yaml", read_cases(BOTH), 10, 1)
    shared = [each for each in problem.parameters if not each.scenarios]
    assert {each.path for each in shared} >= {JERK, "calibration.heading_frequency_rad_per_s"}
    assert len({each.name for each in problem.parameters}) == len(problem.parameters)
    for case in problem.cases:
        starts = [each.start for each in problem.parameters]
        for path, start in problem.values_of(case, starts).items():
            assert value_at(case.loaded, path) == pytest.approx(start)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "- {path: calibration.altitude_error_m.mean, lower: 0, upper: 1}",
            r"line 2, free\[0\]\.path: .*scenario planta_exp1.*scenarios: \[seams2023\]",
        ),
        ("- {path: calibration.jerk, lower: 0, upper: 1}", "line 2.*scenario seams2023.*jerk_m_per_s3"),
        (
            f"- {{path: {JERK}, lower: 0.3, upper: 1, scenarios: [seams203]}}",
            "line 2.*seams203.*did you mean 'seams2023'",
        ),
        (f"- {{path: {JERK}, lower: 0.3, upper: 1, scenarios: []}}", "line 2.*scenarios"),
        (f"- {{path: {JERK}, lower: -2, upper: 1}}", f"line 2.*{JERK}"),
        (
            f"- {{path: {START}, lower: 0, upper: 9}}\n"
            f"  - {{path: {START}, lower: 0, upper: 9, scenarios: [seams2023]}}",
            "line 3.*free twice in scenario seams2023",
        ),
    ],
)
def test_a_wrong_shared_file_says_where_what_and_in_which_scenario(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "free.yaml"
    file.write_text(f"free:\n  {text}\n")
    with pytest.raises(InputError, match=words) as raised:
        read_parameters(file, SCENARIOS)
    assert str(file) in str(raised.value) and "\n" not in str(raised.value)


def test_a_parameter_that_a_campaign_sweeps_cannot_be_free(tmp_path: Path) -> None:
    file = tmp_path / "free.yaml"
    file.write_text("free: [{path: start.y_m, lower: 2, upper: 3}]")
    with pytest.raises(InputError, match=r"start\.y_m is free, but the conditions of planta_exp1"):
        read_problem(file, read_cases(BOTH), 10, 1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((["seams2023", "seams2023.yaml"],), "'seams2023' is given twice"),
        ((["seams2023", "release15"],), "release15: there are no published runs.*--data release15=FILE"),
        ((BOTH, ["seams2023_runs.csv"]), "for instance --data seams2023=seams2023_runs.csv"),
        ((BOTH, ["seams=seams2023_runs.csv"]), "no scenario 'seams'.*did you mean 'seams2023'"),
        ((BOTH, (), "none,bd"), "'bd'"),
        ((["planta_exp1_campaign", "seams2023"], (), "bt"), "seams2023: the data have no missions of bt"),
    ],
)
def test_scenarios_and_data_that_do_not_go_together_are_refused(arguments: tuple, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_cases(*arguments)


def test_files_of_one_scenario_are_one_data_set(tmp_path: Path) -> None:
    lines = (shipped_folder("scenarios/published") / "seams2023_runs.csv").read_text().splitlines(keepends=True)
    for number, part in enumerate((lines[1:31], lines[31:])):
        (tmp_path / f"part{number}.csv").write_text("".join([lines[0], *part]))
    words = [f"seams2023={tmp_path}/part{number}.csv" for number in range(2)]
    seams, _ = read_cases(BOTH, words)
    assert len(seams.real) == 60 and list(seams.digests) == ["part0.csv", "part1.csv"]


def calibrate(*arguments: str) -> int | str | None:
    with pytest.raises(SystemExit) as ended:
        main(["calibrate", *arguments, "--runs", "2", "--evaluations", "2", "--workers", "1"])
    return ended.value.code


def test_the_command_writes_a_scenario_for_each_and_judges_conditions_that_were_held_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    free = tmp_path / "free.yaml"
    free.write_text(
        f"free:\n  - {{path: {JERK}, lower: 0.3, upper: 1.0}}\n"
        f"  - {{path: {START}, lower: 3, upper: 14, scenarios: [planta_exp1]}}\n"
    )
    out = tmp_path / "fit"
    options = ["--parameters", str(free), "--managers", "none", "--fit-conditions", "2,4", "--out", str(out)]
    assert not calibrate(*BOTH, *options)
    names = {"fitted_seams2023.yaml", "fitted_planta_exp1.yaml", "parameters.csv", "calibration.json", "profiles.png"}
    assert {file.name for file in out.iterdir()} == names
    record = json.loads((out / "calibration.json").read_text())
    fitted = {name: load_scenario(out / f"fitted_{name}.yaml") for name in SCENARIOS}
    assert {value_at(each, JERK) for each in fitted.values()} == {round(record["fitted"][JERK], 3)}
    assert value_at(fitted["planta_exp1"], START) == round(record["fitted"][f"planta_exp1: {START}"], 3)
    assert value_at(fitted["seams2023"], START) == value_at(SCENARIOS["seams2023"], START)
    halves = record["conditions"]["planta_exp1"]
    assert [halves[half]["conditions"] for half in ("fitted", "held out")] == [[2, 4], [1, 3, 5, 6]]
    assert list(record["conditions"]) == ["planta_exp1"]
    assert "held out: 1, 3, 5, 6" in capsys.readouterr().out


def test_a_fit_of_one_scenario_replaces_the_files_of_several(tmp_path: Path) -> None:
    out = tmp_path / "fit"
    out.mkdir()
    (out / "fitted_seams2023.yaml").write_text("# Fitted by `suave-des calibrate`; as before\nbase: seams2023\n")
    (out / "fitted_by_hand.yaml").write_text("base: seams2023\n")
    options = ["--parameters", "planta_exp1", "--managers", "none", "--no-profile", "--out", str(out), "--overwrite"]
    assert not calibrate("planta_exp1_campaign", *options)
    assert {file.name for file in out.iterdir()} == {"fitted.yaml", "fitted_by_hand.yaml", "calibration.json"}


def test_a_fitted_scenario_finds_the_users_own_file_that_it_builds_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text("base: seams2023\nmission: {time_limit_s: 250}\n")
    free = Path("free.yaml")
    free.write_text(f"free: [{{path: {JERK}, lower: 0.3, upper: 1.0}}]")
    assert not calibrate("mine.yaml", "--parameters", str(free), "--managers", "none", "--no-profile", "--out", "fit")
    assert load_scenario("fit/fitted.yaml").scenario.mission.time_limit_s == 250


@pytest.mark.parametrize(
    ("scenarios", "conditions", "words"),
    [
        (["seams2023"], "1", "no scenario has conditions"),
        (BOTH, "1,x", "is not a list of conditions"),
        (BOTH, "1,1", "is not a list of conditions"),
        (BOTH, "7", "there is no condition 7"),
        (BOTH, "1,2,3,4,5,6", "has no other condition"),
    ],
)
def test_conditions_that_cannot_be_held_out_are_refused(
    scenarios: list[str], conditions: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert calibrate(*scenarios, "--fit-conditions", conditions, "--out", str(tmp_path / "fit")) == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "fit").exists()
