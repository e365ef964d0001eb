"""analysis/calibrate.py: its distance, its parameter files, a fit that finds what was planted, and
what it writes.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

from suave_des import InputError, load_scenario, with_values
from suave_des.simulation.simulator import Simulator
from tests.helpers.command import python

FOLDER = Path(__file__).parents[2] / "analysis"
sys.path.insert(0, str(FOLDER))
from calibration import cases, loss  # noqa: E402
from calibration.fit import fit  # noqa: E402

sys.path.remove(str(FOLDER))

JERK, START, ORIGIN = (
    "calibration.jerk_m_per_s3",
    "latencies.search_start_s",
    "calibration.origin_y_m",
)
BOTH = ("seams2023", "planta_exp1_campaign")


@pytest.fixture(scope="module")
def both() -> tuple[cases.Case, ...]:
    return cases.read_cases(BOTH)


def planted(name: str, values: dict, conditions: dict, real_runs: int = 8) -> cases.Case:
    """A case whose real missions are simulated with other values."""
    loaded = load_scenario(name)
    real = [
        loss.simulate(
            Simulator(with_values(loaded, {**values, **condition})), "none", real_runs, 99
        ).assign(condition=number)
        for number, condition in conditions.items()
    ]
    return cases.Case(name, loaded, pandas.concat(real, ignore_index=True), conditions, base=name)


def test_energy_distance_by_hand():
    x, y = np.array([[0.0], [2.0]]), np.array([[1.0], [1.0]])
    # 2 E|X - Y| = 2, E|X - X'| = 1 (two of four pairs are 2 apart), E|Y - Y'| = 0.
    assert loss.energy_distance(x, y) == pytest.approx(1.0)
    known, partly = np.array([[0.0, 0.0]]), np.array([[3.0, math.nan]])
    assert loss.energy_distance(known, partly) == pytest.approx(2.0 * 3.0 * math.sqrt(2.0))


def test_a_fit_of_two_scenarios_finds_the_value_that_was_planted_in_both():
    conditions = {1: {"start.y_m": 2.455}, 2: {"start.y_m": 2.963}}
    made = (
        planted("seams2023", {ORIGIN: -0.2}, {1: {}}),
        planted("planta_exp1", {ORIGIN: -0.2}, conditions),
    )
    problem = cases.Problem(made, (cases.FreeParameter(ORIGIN, -0.5, 0.3, 0.0),), 8, 1)
    tried = fit(problem, 20, workers=1, seed=1)
    assert min(tried, key=lambda each: each.loss).values[0] == pytest.approx(-0.2, abs=0.09)


def test_a_parameter_of_one_scenario_changes_that_one_only():
    made = planted("seams2023", {}, {1: {}}), planted("planta_exp1", {}, {1: {}})
    free = tuple(cases.FreeParameter(ORIGIN, -0.5, 0.3, 0.0, (case.name,)) for case in made)
    one, other = (
        loss.evaluate(cases.Problem(made, free, 4, 1), values)
        for values in ([-0.3, 0.1], [0.1, 0.1])
    )
    assert one.cases[0] != other.cases[0] and one.cases[1] == other.cases[1]


@pytest.mark.parametrize(
    ("name", "scenarios"), [("seams2023", BOTH[:1]), ("planta_exp1", BOTH[1:]), ("shared", BOTH)]
)
def test_files_of_free_parameters_start_from_the_scenarios(both, name, scenarios):
    own = [case for case, given in zip(both, BOTH, strict=True) if given in scenarios]
    problem = cases.read_problem(name, own, 10, 1)
    for case in problem.cases:
        starts = problem.values_of(case, [each.start for each in problem.parameters])
        assert starts == {path: pytest.approx(cases.value_at(case.loaded, path)) for path in starts}
    assert [len(case.real) for case in own] == [
        {"seams2023": 60, "planta_exp1": 120}[case.name] for case in own
    ]


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (f"path: {JERK}, lower: 0.9, upper: 1.0", "starts at 0.5, outside"),
        ("path: calibration.jerk, lower: 0, upper: 1", "jerk"),
        (f"path: {JERK}, lower: 0.3, uper: 1.0", "uper"),
        (f"path: {JERK}, lower: 0.3, upper: 1.0, scenarios: [seams203]", "seams203"),
        ("path: start.y_m, lower: 2, upper: 3", "the conditions of planta_exp1 set it"),
    ],
)
def test_a_wrong_parameter_file_is_refused(both, tmp_path, entry, words):
    file = tmp_path / "free.yaml"
    file.write_text(f"free: [{{{entry}}}]")
    with pytest.raises(InputError, match=words) as raised:
        cases.read_problem(file, both, 10, 1)
    assert str(file) in str(raised.value)


@pytest.mark.slow
def test_the_program_writes_fitted_scenarios(tmp_path):
    free = f"free:\n  - {{path: {JERK}, lower: 0.3, upper: 1.0}}\n"
    free += (
        "  - {path: calibration.altitude_error_m.mean, lower: 0.1, upper: 1.2, scenarios: [mine]}\n"
    )
    (tmp_path / "free.yaml").write_text(free)
    (tmp_path / "mine.yaml").write_text("base: seams2023\nmission: {time_limit_s: 250}\n")
    words = [
        "mine.yaml",
        BOTH[1],
        "--data",
        "mine=seams2023_runs.csv",
        "--parameters",
        "free.yaml",
        "--runs",
        "2",
    ]
    few = ["--evaluations", "2", "--managers", "none", "--workers", "1", "--out", "fit"]
    ended = python(FOLDER / "calibrate.py", *words, *few, cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    names = {
        "fitted_mine.yaml",
        "fitted_planta_exp1.yaml",
        "parameters.csv",
        "calibration.json",
        "profiles.png",
    }
    assert {file.name for file in (tmp_path / "fit").iterdir()} == names
    fitted = load_scenario(tmp_path / "fit" / "fitted_mine.yaml")
    record = json.loads((tmp_path / "fit" / "calibration.json").read_text())
    assert cases.value_at(fitted, JERK) == round(record["fitted"][JERK], 3)
    assert fitted.scenario.mission.time_limit_s == 250


@pytest.mark.parametrize("place", [0, 1])
def test_committed_fitted_scenarios_are_what_the_program_writes_of_the_committed_values(
    both, place
):
    folder = FOLDER / "calibration"
    problem = cases.read_problem("shared", both, 60, 1)
    fitted = json.loads((folder / "calibration.json").read_text(encoding="utf-8"))["fitted"]
    values = [round(fitted[each.name], 3) for each in problem.parameters]
    case = problem.cases[place]
    written = (folder / f"fitted_{case.name}.yaml").read_text(encoding="utf-8")
    assert cases.fitted_scenario(problem, case, values, folder) == written
