"""Calibration: its distance, its parameter files, a fit that finds what was planted, and what it writes."""

import json
import math
from pathlib import Path

import numpy as np
import pandas
import pytest
import yaml

from suave_des.calibration.cases import Case
from suave_des.calibration.fit import Profile, _crossing, fit
from suave_des.calibration.loss import (
    CaseLoss,
    Evaluation,
    FreeParameter,
    Problem,
    as_vectors,
    compare,
    energy_distance,
    evaluate,
    resampling_spread,
    simulate,
)
from suave_des.calibration.parameters import read_parameters
from suave_des.calibration.report import fitted_scenario, fitted_values, profiles_png, table
from suave_des.cli.main import main
from suave_des.errors import InputError
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario, value_at, with_values
from suave_des.simulation.simulator import Simulator

GAIN = "calibration.position_gain_per_s"
ORIGIN = "calibration.origin_y_m"
SEAMS = {"seams2023": load_scenario("seams2023")}


def test_energy_distance_of_two_pairs_of_points_by_hand() -> None:
    x, y = np.array([[0.0], [2.0]]), np.array([[1.0], [1.0]])
    # 2 E|X - Y| = 2, E|X - X'| = 1 (two of four pairs are 2 apart), E|Y - Y'| = 0.
    assert energy_distance(x, y) == pytest.approx(1.0)


def test_energy_distance_is_nought_for_equal_samples_and_grows_with_a_shift() -> None:
    sample = np.random.Generator(np.random.PCG64(1)).normal(size=(60, 3))
    assert energy_distance(sample, sample) == pytest.approx(0.0, abs=1e-12)
    near, far = energy_distance(sample, sample + 0.2), energy_distance(sample, sample + 1.0)
    assert 0.0 < near < far


def test_an_unknown_component_is_left_out_and_the_others_count_for_it() -> None:
    known = np.array([[0.0, 0.0]])
    assert energy_distance(known, np.array([[3.0, math.nan]])) == pytest.approx(2.0 * 3.0 * math.sqrt(2.0))


def test_missions_are_scaled_to_comparable_numbers() -> None:
    columns = {"search_time_s": [80.0], "distance_inspected_m": [24.0], "detection_x_m": [-18.0]}
    assert as_vectors(pandas.DataFrame(columns)).tolist() == [[2.0, 2.0, -12.0]]


def test_a_component_that_is_never_known_for_a_manager_is_left_out() -> None:
    columns = {"condition": 1, "search_time_s": 80.0, "distance_inspected_m": 24.0}
    real = pandas.DataFrame({"manager": ["none", "random"], "detection_x_m": [-18.0, math.nan], **columns})
    case = Case("any", load_scenario("seams2023"), real)
    assert compare(case, real.assign(detection_x_m=-15.0)).distances == {"none": 2.0 * 2.0, "random": 0.0}


@pytest.mark.parametrize(("unit", "value"), [(0.0, 1.0), (1.0, 3.0), (0.25, 1.5), (-0.25, 1.5), (1.25, 2.5)])
def test_coordinates_outside_the_bounds_are_reflected(unit: float, value: float) -> None:
    assert FreeParameter(GAIN, 1.0, 3.0, 2.0).value(unit) == pytest.approx(value)


def planted(scenario: str, values: dict, runs: int = 40, conditions: dict | None = None) -> Case:
    """A case whose real missions are simulated with other values."""
    loaded = load_scenario(scenario)
    conditions = conditions or {1: {}}
    real = [
        simulate(Simulator(with_values(loaded, {**values, **condition})), "none", runs, 99).assign(condition=number)
        for number, condition in conditions.items()
    ]
    return Case(scenario, loaded, pandas.concat(real, ignore_index=True), conditions, base=scenario)


def origin_problem(origin_y_m: float, start: float, real_runs: int, runs: int) -> Problem:
    case = planted("seams2023", {ORIGIN: origin_y_m}, real_runs)
    return Problem((case,), (FreeParameter(ORIGIN, -0.5, 0.3, start),), runs, 1)


def test_the_fit_finds_what_was_planted() -> None:
    problem = origin_problem(-0.2, 0.2, 40, 25)
    tried = fit(problem, 30, workers=1, seed=1)
    best = min(tried, key=lambda each: each.loss)
    assert best.values[0] == pytest.approx(-0.2, abs=0.08)
    assert best.loss < evaluate(problem, [0.2]).loss / 3.0


def test_the_same_fit_twice_is_the_same() -> None:
    problem = origin_problem(-0.2, 0.0, 10, 5)
    assert fit(problem, 8, workers=1, seed=3) == fit(problem, 8, workers=1, seed=3)


def test_the_spread_of_the_loss_repeats_with_its_seed() -> None:
    problem = origin_problem(-0.2, 0.0, 10, 5)
    best = evaluate(problem, [-0.2])
    assert 0.0 < resampling_spread(problem, best, 1) == resampling_spread(problem, best, 1) < 1.0


def test_shipped_parameters_are_in_the_shipped_scenario() -> None:
    form, free = read_parameters(shipped_folder("scenarios/calibration") / "seams2023.yaml", SEAMS)
    assert all(value_at(form["seams2023"], each.path) is not None for each in free)
    assert all(each.lower < each.start < each.upper for each in free)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("free: []", "free"),
        ("free:\n  - {path: calibration.position_gain, lower: 0, upper: 1}", "line 2.*position_gain_per_s"),
        ("free:\n  - {path: calibration, lower: 0, upper: 1}", "line 2.*expected a number in this scenario"),
        (
            f"free:\n  - {{path: {GAIN}, lower: 1, upper: 0}}",
            "line 2.*lower 1 is above upper 0 .give the smaller one as lower",
        ),
        (f"free:\n  - {{path: {GAIN}, lower: 5, upper: 9}}", "line 2.*outside"),
        (f"free:\n  - {{path: {GAIN}, lower: 0, uper: 9}}", "line 2.*upper"),
        ("form: {calibration.drift_y_m: hello}\nfree:\n  - {path: a, lower: 0, upper: 1}", "drift_y_m"),
    ],
)
def test_a_wrong_parameter_file_says_where_and_what(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "free.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=words) as raised:
        read_parameters(file, SEAMS)
    assert "\n" not in str(raised.value)


def test_a_fitted_scenario_loads_with_the_fitted_values(tmp_path: Path) -> None:
    paths = (GAIN, "calibration.altitude_error_m.mean", "revision.set_points.loss_probability")
    free = tuple(FreeParameter(path, 0.0, 1.0, 0.5) for path in paths)
    case = Case("seams2023", SEAMS["seams2023"], pandas.DataFrame(), base="seams2023")
    values = fitted_values(Evaluation((0.41234, 0.3, 0.05), ()))
    file = tmp_path / "fitted.yaml"
    file.write_text(fitted_scenario(Problem((case,), free, 1, 1), case, values, tmp_path))
    fitted = load_scenario(file)
    assert [value_at(fitted, path) for path in paths] == [0.412, 0.3, 0.05]
    assert fitted.scenario.revision.follow == load_scenario("seams2023").scenario.revision.follow
    assert yaml.safe_load(file.read_text())["base"] == "seams2023"


def test_the_admitted_interval_ends_where_the_loss_crosses_the_threshold() -> None:
    assert _crossing(1.0, 0.0, [(1.5, 0.05), (2.0, 0.2), (3.0, 0.9)], 0.1) == pytest.approx(1.5 + 0.5 / 3.0)
    assert _crossing(1.0, 0.0, [(0.5, 0.05), (0.0, 0.06)], 0.1) == 0.0  # never crossed: the bound


def test_profiles_become_a_table_and_a_picture() -> None:
    one = Profile(FreeParameter(GAIN, 0.2, 1.2, 0.6), 0.5, (0.2, 0.5, 1.2), (0.9, 0.1, 0.8), 0.4, 0.7)
    assert table([one]).splitlines()[1] == f"{GAIN},0.2,1.2,0.6,0.5,0.4,0.7"
    assert profiles_png([one], Evaluation((0.5,), (CaseLoss({"none": 0.1}, 0.0),)), 0.2).startswith(b"\x89PNG")


def test_the_command_writes_a_scenario_a_report_and_the_profiles(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    free = tmp_path / "free.yaml"
    free.write_text(f"free:\n  - {{path: {GAIN}, lower: 0.5, upper: 1.5}}\n")
    out = tmp_path / "fit"
    arguments = ["calibrate", "seams2023", "--parameters", str(free), "--managers", "none", "--runs", "3"]
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--evaluations", "4", "--workers", "1", "--out", str(out)])
    assert not ended.value.code
    assert {file.name for file in out.iterdir()} == {
        "fitted.yaml",
        "parameters.csv",
        "calibration.json",
        "profiles.png",
    }
    record = json.loads((out / "calibration.json").read_text())
    assert record["managers"] == ["none"] and len(record["history"]) == record["evaluations"]
    assert value_at(load_scenario(out / "fitted.yaml"), GAIN) == pytest.approx(record["fitted"][GAIN], abs=0.001)
    assert "loss" in capsys.readouterr().out
