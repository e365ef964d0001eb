"""Real missions assisted by simulated ones: the estimator, what it is given, and how often its
intervals hold.
"""

import math
from functools import cache
from itertools import product
from pathlib import Path
from statistics import fmean, variance

import numpy as np
import pandas
import pytest
from scipy.stats import t

from suave_des.campaign.campaign import run_campaign
from suave_des.errors import InputError
from suave_des.reality.assisted import AssistedComparison, Chance, assisted_mean, compare_assisted
from suave_des.reality.missions import matched
from suave_des.records.missions import missions_in
from tests.helpers.command import command_here

REAL = Path(__file__).parents[2] / "scenarios" / "published" / "planta_exp1_runs.csv"


def missions(
    seed: int,
    conditions: np.ndarray,
    runs: int,
    shift_s: float = 0.0,
    noise_s: float = 2.0,
    managers: str = "ab",
) -> pandas.DataFrame:
    """Missions of managers whose search takes 60 s more for each metre of start.y_m; the second's
    20 s more.
    """
    rows = product(managers, conditions, range(1, runs + 1))
    frame = pandas.DataFrame(rows, columns=["manager", "start.y_m", "run"]).assign(
        scenario="s", seed=seed
    )
    noise = noise_s * np.random.default_rng(seed).normal(size=(len(frame), 2))
    search_time_s = (
        60.0 * frame["start.y_m"] + 20.0 * (frame["manager"] == "b") + shift_s + noise[:, 0]
    )
    frame = frame.assign(
        search_time_s=search_time_s, distance_inspected_m=20.0 * frame["start.y_m"] + noise[:, 1]
    )
    return frame.assign(pipeline_found=True, mission_duration_s=300.0)


def population(seed: int = 3, draws: int = 200, **changed: float) -> pandas.DataFrame:
    conditions = np.random.default_rng(seed).uniform(1.0, 3.0, draws)
    frame = missions(seed, conditions, 1, **changed)
    return frame.assign(run=frame.groupby("manager").cumcount() + 1)


POINTS = np.array([1.1, 1.4, 1.9, 2.1, 2.2, 2.9])


def real_missions(runs: int, shift_s: float = 0.0, points: np.ndarray = POINTS) -> pandas.DataFrame:
    return missions(1, points, runs, shift_s).drop(columns=["run", "seed"])


def shifted(by: float, times: float = 1.0) -> pandas.DataFrame:
    frame = population()
    return frame.assign(**{"start.y_m": times * frame["start.y_m"] + by})


def with_depth(frame: pandas.DataFrame, slope: float) -> pandas.DataFrame:
    """Starts at depths of -4 to -2 m, which rise or fall with start.y_m."""
    return frame.assign(**{"start.z_m": slope * (frame["start.y_m"] - 2.0) - 3.0})


def compared(**changed: pandas.DataFrame) -> AssistedComparison:
    given = {
        "real": real_missions(2, 25.0),
        "same": missions(2, POINTS, 5),
        "population": population(),
    } | changed
    real, *simulated = map(missions_in, given.values())
    return compare_assisted(real, simulated)


@cache
def by_values() -> pandas.DataFrame:
    """Estimates where real missions have the values of their conditions."""
    return compared().estimates


# The estimator


def test_the_mean_is_that_of_ppi_python():
    real = np.array([52.0, 118, 83, 61, 97, 130, 75, 88, 143, 69, 110, 92])
    same = np.array([55.0, 121, 80, 57, 101, 127, 79, 93, 136, 66, 113, 99])
    many = np.array(
        [50.0, 64, 71, 83, 88, 95, 104, 110, 116, 125, 133, 140, 59, 77, 92, 101, 120, 86, 98, 107]
    )
    # ppi_mean_pointestimate of ppi-python 0.2.3, for this and for a simulation that is hardly of
    # use
    found, weight = assisted_mean(real, same, many)
    assert found.value == pytest.approx(94.54777428140198, abs=1e-9)
    assert weight == pytest.approx(0.6792332531485169, abs=1e-9)
    noise = np.array([30.0, -40, 22, -28, 35, -31, -18, 44, -25, 39, -33, 11])
    assert assisted_mean(real, same + noise, many)[0].value == pytest.approx(93.51167902, abs=1e-8)


def by_hand(real, same, many, weight: float, freedom: int, least: float) -> tuple[float, ...]:
    """The mean and the ends of its interval by plain sums; `least` is that of the variance."""
    mean = fmean(real) + weight * (fmean(many) - fmean(same))
    seen = variance([each - weight * other for each, other in zip(real, same, strict=True)])
    unlike = 0.1**2 * variance(many)
    square = max(seen, least) / len(real) + weight**2 * (variance(many) / len(many) + unlike)
    half = float(t.ppf(0.9875, freedom)) * math.sqrt(square)  # of 97.5%, as one of two is chosen
    return mean, mean - half, mean + half


@pytest.mark.parametrize(
    ("n", "off", "weight", "freedom"),
    [
        (12, (3, 3, -3, -4, 4, -3, 4, 5, -7, -3, 3, 7), 0.6149, 10),
        (6, (3, 3, -3, -4, 4, -3), 1.0, 5),
        (6, (90, -60, -3, 70, -44, -90), 0.0, 5),
    ],
)
def test_the_estimate_is_that_of_plain_sums(n, off, weight, freedom):
    real = [52.0, 118, 83, 61, 97, 130, 75, 88, 143, 69, 110, 92][:n]
    same = [each + other for each, other in zip(real, off, strict=True)]
    many = [50.0, 64, 71, 83, 88, 95, 104, 110, 116, 125, 133, 140, 59, 77, 92, 101, 120, 86]
    found, found_weight = assisted_mean(*map(np.array, (real, same, many)))
    assert found_weight == pytest.approx(weight, abs=1e-4)
    least = (1.0 - found_weight) ** 2 * variance(many)
    expected = by_hand(real, same, many, found_weight, freedom, least)
    assert (found.value, found.low, found.high) == pytest.approx(expected, abs=1e-9)


def test_with_few_conditions_the_simulation_counts_fully_or_not_at_all():
    real, many = np.array([52.0, 118, 83]), np.linspace(50.0, 140.0, 200)
    found, weight = assisted_mean(real, real + 4.0 + np.array([1.0, -1.0, 0.0]), many)
    assert weight == 1.0
    assert found.value == pytest.approx(many.mean() - 4.0)
    off, weight = assisted_mean(real, np.array([190.0, 60.0, 100.0]), many)
    assert weight == 0.0
    assert off.value == pytest.approx(real.mean())


@pytest.mark.parametrize(("share", "weight"), [(0.49, 1.0), (0.51, 0.0)])
def test_the_simulation_counts_where_it_leaves_less_than_half_of_the_standard_deviation(
    share, weight
):
    real, many = np.array([50.0, 150, 50, 150, 50, 150]), np.linspace(0.0, 200.0, 500)
    off = share * np.array([50.0, 50, 50, -50, -50, -50]) / np.std([50.0, 50, 50, -50, -50, -50])
    same = real - off * 50.0
    assert assisted_mean(real, same, many)[1] == weight


def test_deviations_that_happen_to_be_equal_are_not_taken_for_certain():
    real, many = np.array([52.0, 118, 83]), np.linspace(50.0, 140.0, 10_000)
    chance = Chance(9.0, 3.0, 3.0, 2.0)
    narrow, _ = assisted_mean(real, real + 4.0, many)
    wide, _ = assisted_mean(real, real + 4.0, many, chance)
    unlike = 0.1**2 * many.var(ddof=1)
    assert narrow.high - narrow.low == pytest.approx(2 * 6.205347 * math.sqrt(unlike), 0.01)
    least = 12.0 / 3 + many.var(ddof=1) / 10_000 + 2.0 + 0.1**2 * (many.var(ddof=1) - 3.0)
    assert wide.high - wide.low == pytest.approx(2 * 6.205347 * math.sqrt(least), 1e-6)


@pytest.mark.parametrize("n", [6, 12, 30])
def test_intervals_hold_the_mean_where_the_simulation_is_wrong_in_few_conditions(n):
    chance, covered = np.random.default_rng(n), 0
    for _ in range(200):
        at = chance.choice([50.0, 90.0, 130.0], n)
        real = at + chance.normal(0.0, 2.0, n) + 60.0 * (chance.random(n) < 0.08)
        many = chance.choice([50.0, 90.0, 130.0], 400)
        found, _ = assisted_mean(real, at, many, Chance(4.0, 0.0, 0.0))
        covered += found.contains(90.0 + 0.08 * 60.0)
    assert covered / 200 >= 0.93


@pytest.mark.parametrize("n", [6, 12])
def test_differences_of_managers_allow_for_conditions_in_which_one_is_late(n):
    chance, covered = np.random.default_rng(n), 0
    many = chance.normal(0.0, 1.0, 400)
    for _ in range(200):
        real = chance.normal(0.0, 1.0, n) + 60.0 * (chance.random(n) < 0.08)
        same = chance.normal(0.0, 1.0, n)
        found, _ = assisted_mean(real, same, many, Chance(1.0, 1.0, 1.0), 33.0)
        covered += found.contains(0.08 * 60.0)
    assert covered / 200 >= 0.93


def test_one_manager_alone_has_no_allowance_but_pays_for_the_choice():
    real, same = np.array([52.0, 118, 83, 61]), np.array([130.0, 40, 90, 110])
    found, weight = assisted_mean(real, same, np.linspace(80.0, 90.0, 20))
    assert weight == 0.0
    # Bonferroni: t of 3 degrees of freedom at 98.75%
    assert found.high - found.value == pytest.approx(4.176535 * real.std(ddof=1) / 2.0, 1e-6)


@pytest.mark.parametrize("shift_s", [0.0, 40.0])
@pytest.mark.parametrize("n", [3, 6, 30])
def test_intervals_hold_the_truth_also_of_a_biased_simulation(n, shift_s):
    chance, covered = np.random.default_rng(n), 0
    for _ in range(200):
        at = chance.choice([50.0, 120.0, 130.0], n)
        real = at + chance.normal(0.0, 6.0, n) + shift_s
        many = chance.choice([50.0, 120.0, 130.0], 400) + chance.normal(0.0, 3.0, 400)
        found, _ = assisted_mean(real, at + chance.normal(0.0, 2.0, n), many, Chance(9.0, 4.0, 9.0))
        covered += found.contains(100.0 + shift_s)
    assert covered / 200 >= 0.92


# Comparisons


def test_a_comparison_corrects_what_the_conditions_do():
    found = compared()
    by_name = found.estimates.set_index(["metric", "group", "other"])
    row = by_name.loc[("search_time_s", "a", "")]
    assert (row["runs"], row["conditions"], row["weight"]) == (12, 6, 1.0)
    assert row["assisted_ci95_low"] < 60.0 * 2.0 + 25.0 < row["assisted_ci95_high"]
    assert row["narrower"] > 3.0
    difference = by_name.loc[("search_time_s", "a", "b")]
    assert difference["runs"] == 24
    assert difference["assisted"] == pytest.approx(-20.0, abs=3.0)
    assert found.estimates["conclusion"].str.contains("^a finds the pipeline.* sooner than b").any()
    assert [note.split(" are ")[0] for note in found.notes] == [
        "intervals and numbers of runs needed"
    ]


def test_few_conditions_do_not_tell_how_many_the_simulation_is_worth():
    few, points = compared().estimates, np.linspace(1.1, 2.9, 12)
    many = compared(real=real_missions(1, 5.0, points), same=missions(2, points, 5)).estimates
    assert "equal_conditions_low" not in few
    row = many.query("group == 'a' and other == '' and metric == 'search_time_s'").iloc[0]
    half = (row["assisted_ci95_high"] - row["assisted_ci95_low"]) / 2.0
    # The 95% chi-square interval of a standard deviation from 12 values: 0.7084 to 1.6979 times it.
    std_s = real_missions(1, 5.0, points).query("manager == 'a'")["search_time_s"].std()
    for name, factor in (("low", 0.7084), ("high", 1.6979)):
        runs = row[f"equal_conditions_{name}"]
        assert t.ppf(0.975, runs - 1) * factor * std_s / math.sqrt(runs) == pytest.approx(
            half, 0.05
        )
    low, high = row["equal_conditions_low"], row["equal_conditions_high"]
    text = f"as that of {low:.0f} to {high:.0f} conditions with real missions alone."
    assert row["conclusion"].endswith(text)


def test_a_simulation_that_does_not_help_leaves_the_mean_of_the_real_missions():
    same = missions(2, POINTS, 5)
    same["search_time_s"] = 300.0 - same["search_time_s"]
    found = compared(same=same).estimates.set_index(["metric", "group", "other"])
    row = found.loc[("search_time_s", "a", "")]
    assert row["weight"] == 0.0
    assert row["assisted"] == row["alone"]
    assert row["conclusion"].endswith("; the simulation does not help.")


def test_repetitions_that_differ_widen_the_interval():
    real = real_missions(2, 25.0)
    halves = []
    for apart_s in (0.0, 60.0):
        first = real.groupby(["manager", "start.y_m"]).cumcount() == 0
        changed = real["search_time_s"] + np.where(first, apart_s / 2.0, -apart_s / 2.0)
        estimates = compared(real=real.assign(search_time_s=changed)).estimates
        row = estimates.query("group == 'a' and other == '' and metric == 'search_time_s'").iloc[0]
        halves.append((row["assisted_ci95_high"] - row["assisted_ci95_low"]) / 2.0)
    # 60 s apart: variance 1800 of a mission, 900 of a mean of two; t of 5 degrees of freedom, 97.5%.
    assert halves[1] > 3.1634 * math.sqrt(900.0 / 6) > halves[0]


def test_a_difference_allows_for_unlike_conditions_also_if_the_simulation_never_varies():
    real = real_missions(1)
    same, many = (
        frame.assign(search_time_s=300.0) for frame in (missions(2, POINTS, 5), population())
    )
    found = compared(real=real, same=same, population=many).estimates
    row = found.set_index(["metric", "group", "other"]).loc[("search_time_s", "a", "b")]
    times_s = real.pivot_table("search_time_s", "start.y_m", "manager")
    by_chance = (times_s["a"] - times_s["b"]).var() / 6
    half = 3.163381 * math.sqrt(by_chance + (0.1 * times_s.std().max()) ** 2)
    assert row["assisted_ci95_high"] - row["assisted"] == pytest.approx(half, 1e-6)


def test_a_share_has_an_interval_for_shares():
    points = np.linspace(1.05, 2.95, 30)
    real, same = real_missions(1, 5.0, points), missions(2, points, 5)
    simulated = [missions_in(same), missions_in(population())]
    found = compare_assisted(missions_in(real), simulated, metrics=["pipeline_found"])
    row = found.estimates.iloc[0]
    # 30 of 30 by Wilson: n / (n + 1.96^2).
    assert row["assisted_ci95_low"] == pytest.approx(30 / (30 + 1.959964**2), abs=1e-6)
    assert row["conclusion"].endswith("; simulated missions do not assist shares.")


def test_a_manager_without_a_metric_is_left_out_of_it():
    sides = [real_missions(2), missions(2, POINTS, 5), population()]
    for frame in sides:
        frame["mean_reaction_time_s"] = np.where(
            frame["manager"] == "a", frame["start.y_m"], np.nan
        )
    real, *simulated = map(missions_in, sides)
    metrics = ["search_time_s", "mean_reaction_time_s"]
    found = compare_assisted(real, simulated, metrics=metrics)
    reactions = found.estimates.query("metric == 'mean_reaction_time_s'")
    assert reactions["group"].tolist() == ["a"]
    assert found.notes[-1] == "b is left out of mean reaction time, of which it has no value"


@pytest.mark.parametrize("dropped", ["start.y_m", ["start.y_m", "condition"]])
def test_conditions_are_found_by_their_number_or_order(dropped):
    numbered = real_missions(2, 25.0).assign(condition=np.repeat([1, 2, 3, 4, 5, 6] * 2, 2))
    found = compared(real=numbered.drop(columns=dropped)).estimates
    pandas.testing.assert_frame_equal(found, by_values())


def test_missions_that_never_found_the_pipeline_count_with_the_limit():
    real, same = real_missions(2), missions(2, POINTS, 5)
    for frame, end_s in ((real, 301.0), (same, 300.0)):
        frame.loc[0, ["search_time_s", "pipeline_found"]] = [end_s, False]
    found = compared(real=real, same=same)
    times_s = real["search_time_s"].clip(upper=300.0)[real["manager"] == "a"]
    assert found.estimates["alone"][0] == pytest.approx(times_s.mean())
    assert any("had not found the pipeline by 300 s (a 1 of 12" in note for note in found.notes)


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"real": real_missions(2, points=POINTS + 9.0)}, "that have start.y_m=10.1: none"),
        ({"same": missions(2, POINTS, 1)}, "there is 1 simulated mission"),
        ({"same": missions(2, POINTS[:1], 5)}, "sweep no conditions"),
        ({"real": real_missions(2, points=POINTS[:2])}, "there are 2 conditions"),
        ({"population": population(draws=5)}, "there are 5 draws"),
        (
            {"population": population().assign(scenario="other")},
            "population: it is of scenario other, and the missions under the real conditions of s",
        ),
        (
            {"population": population().drop(columns="start.y_m")},
            "population: it does not draw start.y_m, in which the real conditions differ",
        ),
        (
            {"population": population().assign(**{"start.x_m": np.arange(400.0)})},
            "population: it draws start.x_m, which is one for all the missions under the real",
        ),
        (
            {"population": shifted(-1.2)},
            "population: it draws start.y_m from -0.197703 to 1.79961, and a real condition has 2.1",
        ),
        (
            {"population": shifted(-25.0, 25.0)},
            "population: it draws start.y_m otherwise than the real conditions are spread: from",
        ),
        (
            {
                "real": with_depth(real_missions(2), 1.0),
                "same": with_depth(missions(2, POINTS, 5), 1.0),
                "population": with_depth(population(), -1.0),
            },
            "population: it draws start.y_m and start.z_m apart, which the real conditions do not",
        ),
        ({"population": missions(2, POINTS, 5)}, "it sweeps start.y_m"),
        (
            {"population": population().assign(search_time_s=math.nan)},
            "search_time_s has a value that is no number",
        ),
        (
            {"same": missions(2, POINTS, 5).assign(distance_inspected_m=math.inf)},
            "distance_inspected_m has a value",
        ),
        ({"same": missions(2, POINTS, 5, managers="a")}, "there is no mission of b"),
        (
            {"population": population().assign(mission_duration_s=400.0)},
            "missions of a end after 400 s, real missions after 300 s",
        ),
        (
            {"real": real_missions(3).drop(columns="start.y_m")[:-1]},
            "6 conditions do not share evenly",
        ),
        (
            {"real": real_missions(1).assign(condition=7).drop(columns="start.y_m")},
            "there is no condition 7",
        ),
    ],
)
def test_what_does_not_belong_together(changed, text):
    with pytest.raises(InputError) as raised:
        compared(**changed)
    assert text in str(raised.value) and raised.value.remedy


def test_other_starts_are_other_conditions():
    real, same = real_missions(2), missions(2, POINTS, 5)
    same["initial_y_m"] = same["start.y_m"] + 0.4
    in_order = real.assign(initial_y_m=real["start.y_m"]).drop(columns="start.y_m")
    assert compared(real=in_order, same=same).estimates["conditions"].eq(6).all()
    turned = in_order.iloc[::-1].sort_values("manager", kind="stable")
    with pytest.raises(InputError, match="12 missions of manager a, which do not begin where"):
        compared(real=turned, same=same)


def test_numbers_of_conditions_that_contradict_the_starts_are_refused():
    real, same = real_missions(2), missions(2, POINTS, 5)
    same["initial_y_m"] = same["start.y_m"] + 0.4
    places = real["start.y_m"].map({at: 6 - number for number, at in enumerate(POINTS)})
    turned = real.assign(initial_y_m=real["start.y_m"], condition=places).drop(columns="start.y_m")
    with pytest.raises(InputError, match="initial_y_m of manager a under condition 1 is"):
        compared(real=turned, same=same)


def test_missions_of_one_manager_in_reverse_are_refused():
    real, same = real_missions(2), missions(2, POINTS, 5)
    same["initial_y_m"] = same["start.y_m"]
    real = real.assign(initial_y_m=real["start.y_m"]).drop(columns="start.y_m")
    half = real[real["manager"] == "b"].iloc[::-1]
    with pytest.raises(InputError, match="12 missions of manager b, which do not begin where"):
        compared(real=pandas.concat([real[real["manager"] == "a"], half]), same=same)


def test_real_missions_without_those_of_a_condition_are_not_assigned_by_their_order():
    real, same = real_missions(5), missions(2, POINTS, 5)
    same["initial_y_m"] = same["start.y_m"]
    real = real.assign(initial_y_m=real["start.y_m"]).drop(columns="start.y_m")
    at = real.groupby("manager").cumcount()
    for left in (at < 24, (at < 5) | (at >= 11)):  # the last six, and the second and one more
        with pytest.raises(InputError, match="24 missions of manager a, which do not begin where"):
            compared(real=real[left], same=same)


def test_runs_with_the_same_values_are_one_draw_also_without_a_manifest():
    frame = population(draws=50)
    four = pandas.concat([frame.assign(run=4 * (frame["run"] - 1) + each) for each in (1, 2, 3, 4)])
    real, same = real_missions(2), missions(2, POINTS, 5)
    counts = [
        matched(real, same, each, ["start.y_m"])[2]["draw"].nunique() for each in (frame, four)
    ]
    assert counts == [50, 50]


# From files


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("assisted")
    run_campaign("planta_exp1_campaign", ["none", "bt"], 2, 1, out=folder / "same")
    drawn = {"start.y_m": {"distribution": "uniform", "minimum": 2.0, "maximum": 3.0}}
    shift = {"distribution": "uniform", "minimum": 0.0, "maximum": 200.0, "shared": "shift"}
    drawn |= {f"thruster_events.{place}.time_s": shift for place in (0, 1)}
    run_campaign(
        "planta_exp1", ["none", "bt"], 40, 1, out=folder / "population", perturbations=drawn
    )
    return folder


def test_the_command(campaigns):
    assisted = ["compare", str(REAL), "--managers", "none,bt", "--assisted-by", "same"]
    both = [*assisted, "--population", "population"]
    shown = command_here(*both, cwd=campaigns)
    assert shown.returncode == 0
    assert "30 in 6" in shown.stdout
    assert "assisted: mean over the population's" in shown.stdout
    assert command_here(*both, "--out", "found.tex", cwd=campaigns).returncode == 0
    assert (campaigns / "found.tex").stat().st_size > 1000
    half = command_here(*assisted, cwd=campaigns)
    assert half.returncode == 2 and "needed together" in half.stderr
