"""Whether intervals from few real missions, assisted by simulated ones, hold, and what they gain.

Coverage: other systems play the real one, and conditions are drawn from 200 again and again. Gains:
the real missions of 2025 (exp1), all 30 of each manager and parts of them.

    python analysis/assisted.py [--out DIR] [--runs N] [--workers N] [--resamples N]

`--runs` are the simulated missions under each condition of the real ones.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import pandas
import studies
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import t

from suave_des import CampaignFrame, load_scenario, run_campaign

SCENARIO = "planta_exp1"
MANAGERS = ("none", "metacontrol", "bt")
PAIRS = (("metacontrol", "bt"), ("none", "bt"))
METRICS = ("search_time_s", "distance_inspected_m")
LIMIT_S = 250.0
SCENARIOS = Path(__file__).parents[1] / "scenarios"
REAL = SCENARIOS / "published" / "planta_exp1_runs.csv"
MEMBERS = (2, 9, 17)
"""Members of the ensemble that play the real system."""
SYSTEMS: Mapping[str, Mapping[str, Any]] = {
    "shipped": {},
    "biased": {"calibration.jerk_m_per_s3": 0.25},
    "another mission": {
        "signals.water_visibility.value": 1.3,
        "default_modes.f_generate_search_path": "fd_spiral_high",
        "calibration.drift_y_m": 1.2,
    },
}
"""Values of the scenario by simulator."""
OTHER_REVISION = 'base: planta_exp1.yaml\nrevision: "1.5"\n'
"""A scenario with the habits of other software."""
DRAWN = {
    "start.y_m": {"distribution": "uniform", "minimum": 2.0, "maximum": 3.0},
    **{
        f"thruster_events.{place}.time_s": {
            "distribution": "uniform",
            "minimum": 0.0,
            "maximum": 200.0,
            "shared": "shift",
        }
        for place in (0, 1)
    },
}
"""What the study's runner drew for every five runs."""
DRAWS, EACH, LEFT = 200, 5, 3
"""Conditions, missions under each, and how many of these are the simulator's."""
SAMPLES = ((6, 1), (6, 5), (8, 1), (12, 1), (20, 1), (30, 1))
"""Conditions of the real missions, and missions under each."""
RESAMPLES = 6_000
LATE_S = 60.0
"""By how much real missions are late in the conditions of which the simulation knows nothing."""
MEDIAN_S = 5.0
"""Median of the times by which they are late in all."""
OF_ALL_METRICS = 5
"""So many of the cases; the others move search times."""
SPLIT_S, SPLIT = 65.0, 0.4
"""Of real missions under a condition that has two outcomes, such as 115, 117, 180, 115, 181 s: how
far these are apart, and the share of the later one.
"""

UNLIKE, LEAST_TO_WEIGH, USEFUL, EACH_OF_TWO = 0.1, 10, 0.5, 0.975
"""As of the estimator: share of all conditions that may be unlike those sampled, conditions from
which on the weight is estimated, what the simulation may leave of fewer, and the confidence of each
of two intervals.
"""

Array = NDArray[np.float64]
Cells = Array
"""Values of a metric, shape (conditions, missions under each)."""
System = Mapping[str, Cells]
"""By manager."""


class Case(NamedTuple):
    """What plays the real system, and what the simulator.

    Attributes:
        real: systems that play it in turn.
        is_beyond: whether it is more than intervals allow for.
    """

    name: str
    real: Sequence[System]
    simulator: System
    is_beyond: bool = False


# Missions


def sweep_of(draws: int) -> Mapping[str, Any]:
    """Draw conditions as the study's runner did."""
    chance = np.random.default_rng(studies.SEED)
    starts_m = np.round(chance.uniform(2.0, 3.0, draws), 3).tolist()
    times_s = np.round(chance.uniform(0.0, 200.0, draws), 2).tolist()
    times = {f"thruster_events.{place}.time_s": times_s for place in (0, 1)}
    return {"zip": {"start.y_m": starts_m, **times}}


def simulate(scenario: Any, seed: int, workers: int) -> pandas.DataFrame:
    """Run the missions of one system, under the same conditions for all of them."""
    return run_campaign(
        scenario,
        MANAGERS,
        runs=EACH,
        seed=seed,
        workers=workers,
        progress=False,
        sweep=sweep_of(DRAWS),
    )


def simulate_all(workers: int) -> dict[str, pandas.DataFrame]:
    """Run the missions of all systems; the real ones have other random numbers."""
    found = {}
    for name, values in SYSTEMS.items():
        scenario = load_scenario(SCENARIO, values=dict(values))
        found[name] = simulate(scenario, studies.SEED, workers)
    ensemble = pandas.read_csv(
        SCENARIOS / "ensembles" / f"{SCENARIO}.csv", index_col="member"
    ).drop(columns="loss")
    for number in MEMBERS:
        member = load_scenario(SCENARIO, values=ensemble.loc[number].to_dict())
        found[f"member {number}"] = simulate(member, studies.SEED + 1, workers)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "other_revision.yaml"
        path.write_text(OTHER_REVISION, encoding="utf-8")
        found["revision 1.5"] = simulate(load_scenario(path), studies.SEED + 1, workers)
    return found


def system_of(frame: pandas.DataFrame, metric: str) -> System:
    """Return the values of a metric; search times up to the limit."""
    values = frame[metric].astype(float)
    if metric == "search_time_s":
        values = values.clip(upper=LIMIT_S)
    ordered = frame.assign(value=values).sort_values(["start.y_m", "run"])
    return {
        str(name): part["value"].to_numpy().reshape(-1, EACH)
        for name, part in ordered.groupby("manager", observed=True)
    }


def late(
    system: System, share: float, by_s: float = LATE_S, managers: Sequence[str] = MANAGERS
) -> System:
    """Return a system whose missions are late in a share of the conditions."""
    is_late = np.random.default_rng(studies.SEED).random(DRAWS) < share
    return {
        name: values + by_s * is_late[:, None] * (name in managers)
        for name, values in system.items()
    }


def often_late(systems: Sequence[System], sigma: float) -> list[System]:
    """Return systems whose missions are late in each condition, by times whose logarithms are
    normally distributed, but never after the limit.
    """
    chance = np.random.default_rng(studies.SEED)
    late_s = MEDIAN_S * chance.lognormal(0.0, sigma, (len(systems), DRAWS, 1))
    return [
        {name: np.minimum(values + by_s, LIMIT_S) for name, values in system.items()}
        for system, by_s in zip(systems, late_s, strict=True)
    ]


def split(system: System, share: float) -> System:
    """Return a system with two outcomes in a share of the conditions."""
    chance = np.random.default_rng(studies.SEED)
    has_two = chance.random(DRAWS) < share
    return {
        name: values + SPLIT_S * has_two[:, None] * (chance.random(values.shape) < SPLIT)
        for name, values in system.items()
    }


def cases_of(systems: Mapping[str, System]) -> Iterator[Case]:
    """Yield the cases of a metric; those that move search times come last."""
    members = [systems[f"member {number}"] for number in MEMBERS]
    shipped = systems["shipped"]
    yield Case("other parameters", members, shipped)
    yield Case("other revision", [systems["revision 1.5"]], shipped)
    yield Case("biased simulator", members, systems["biased"])
    yield Case("simulator of another mission", members, systems["another mission"])
    mixed = np.random.default_rng(studies.SEED).permutation(DRAWS)
    unrelated = {name: values[mixed] for name, values in shipped.items()}
    yield Case("unrelated simulator", members, unrelated)
    yield Case("16% with two outcomes", [split(each, 0.16) for each in members], shipped)
    yield Case("8% late", [late(each, 0.08) for each in members], shipped)
    one = [late(each, 0.08, managers=["bt"]) for each in members]
    yield Case("8% late under one manager", one, shipped)
    yield Case("5% late by 100 s", [late(each, 0.05, 100.0) for each in members], shipped)
    yield Case("late by log-normal times", often_late(members, 1.0), shipped)
    yield Case("15% late", [late(each, 0.15) for each in members], shipped, is_beyond=True)
    longer = [late(each, 0.15, 100.0) for each in members]
    yield Case("15% late by 100 s", longer, shipped, is_beyond=True)
    wide = often_late(members, 1.5)
    yield Case("late by wider log-normal times", wide, shipped, is_beyond=True)
    never = {name: np.full_like(values, LIMIT_S) for name, values in shipped.items()}
    yield Case("simulator that never finds it", members, never, is_beyond=True)


# Coverage


def signed(system: System, both: Sequence[str]) -> Cells:
    """Return a manager's values, or the differences of two."""
    first, *other = (system[name] for name in both)
    return first - other[0] if other else first


class Sampled(NamedTuple):
    """Many samples of conditions at once.

    Attributes:
        real: means of the real missions, shape (samples, conditions); likewise same, of the
            simulated ones.
        population: means under all other conditions are taken from these, shape (conditions,).
        by_chance: variances that real, same and population have by chance, each (samples,) or a
            number.
        spread: of the real missions of one manager or another, the greater standard deviation,
            shape (samples,).
    """

    real: Array
    same: Array
    population: Array
    by_chance: tuple[Array, Array, float]
    spread: Array | float = 0.0


def sampled(
    real: Sequence[Cells],
    simulator: Cells,
    size: tuple[int, int],
    samples: int,
    chance: np.random.Generator,
) -> Sampled:
    """Draw conditions, missions under each, and the simulated missions that assist them; the real
    ones of one manager, or of two, whose differences count.
    """
    conditions, runs_each = size
    places = chance.integers(0, DRAWS, (samples, conditions))
    # Points of a sweep share the random numbers of a run, which real missions do not.
    runs = np.argsort(chance.random((samples, conditions, EACH)), axis=2)
    of_each = [np.take_along_axis(own[places], runs[..., :runs_each], axis=2) for own in real]
    ours = of_each[0] - of_each[1] if len(real) > 1 else of_each[0]
    spread = np.max([own.mean(axis=2).std(axis=1, ddof=1) for own in of_each], axis=0)
    theirs = np.take_along_axis(simulator[places], runs[..., -LEFT:], axis=2)
    within = theirs.var(axis=2, ddof=1).mean(axis=1)
    repeated = ours.var(axis=2, ddof=1).mean(axis=1) if runs_each > 1 else 0.0
    by_chance = (
        np.maximum(within, repeated) / runs_each,
        within / LEFT,
        float(simulator.var(axis=1, ddof=1).mean()),
    )
    return Sampled(ours.mean(axis=2), theirs.mean(axis=2), simulator[:, 0], by_chance, spread)


def intervals(of: Sampled, spread: Array | float | None) -> tuple[Array, Array, Array]:
    """Return mean, half-width and weight of each sample as `CampaignFrame.assist` estimates them,
    but for all samples at once; a test compares the two.
    """
    samples, conditions = of.real.shape
    if conditions >= LEAST_TO_WEIGH:
        weight = _weight_of_least_variance(of)
    else:
        left = (of.real - of.same).std(axis=1, ddof=1)
        weight = (left <= USEFUL * of.real.std(axis=1, ddof=1)).astype(float)
    half, alone = (_half(of, spread, each) for each in (weight, np.zeros(samples)))
    counts = half < alone
    weight = np.where(counts, weight, 0.0)
    mean = of.real.mean(axis=1) + weight * (of.population.mean() - of.same.mean(axis=1))
    return mean, np.where(counts, half, alone), weight


def _half(of: Sampled, spread: Array | float | None, weight: Array) -> Array:
    conditions, draws = of.real.shape[1], len(of.population)
    chance_real, chance_same, chance_population = of.by_chance
    total = float(of.population.var(ddof=1))
    between = max(0.0, total - chance_population)
    seen = (of.real - weight[:, None] * of.same).var(axis=1, ddof=1)
    least = (1.0 - weight) ** 2 * between + chance_real + weight**2 * chance_same
    apart = weight * np.sqrt(between) if spread is None else spread
    variance = np.maximum(seen, least) / conditions
    variance += weight**2 * total / draws + (UNLIKE * apart) ** 2
    is_estimated = (weight > 0.0) & (conditions >= LEAST_TO_WEIGH)
    return t.ppf((1.0 + EACH_OF_TWO) / 2.0, conditions - 1 - is_estimated) * np.sqrt(variance)


def _weight_of_least_variance(of: Sampled) -> Array:
    samples, conditions = of.real.shape
    simulated = np.hstack([of.same, np.tile(of.population, (samples, 1))])
    off_real = of.real - of.real.mean(axis=1, keepdims=True)
    off_same = of.same - of.same.mean(axis=1, keepdims=True)
    covariance = (off_real * off_same).mean(axis=1)
    variance = (1.0 + conditions / len(of.population)) * simulated.var(axis=1, ddof=1)
    weight = np.divide(covariance, variance, out=np.zeros(samples), where=variance > 0.0)
    return np.clip(weight, 0.0, 1.0)


def simulated_spread(case: Case, both: Sequence[str]) -> float:
    """Return the greater standard deviation of conditions of two managers."""
    cells = (case.simulator[name] for name in both)
    return max(
        max(0.0, each[:, 0].var(ddof=1) - each.var(axis=1, ddof=1).mean()) ** 0.5 for each in cells
    )


def coverage(
    case: Case, both: Sequence[str], size: tuple[int, int], resamples: int
) -> dict[str, Any]:
    """Count how often intervals hold the mean of the system that plays the real one.

    Returns:
        A row: alone and assisted (shares of intervals that hold the mean), alone_half and
        assisted_half (medians of their half-widths), weight (mean), and rms_error of the assisted
        mean.
    """
    chance = np.random.default_rng(studies.SEED)
    simulator = signed(case.simulator, both)
    parts = []
    for system in case.real:
        real = [system[name] for name in both]
        true = signed(system, both).mean()
        of = sampled(real, simulator, size, resamples // len(case.real), chance)
        spread = np.maximum(of.spread, simulated_spread(case, both)) if len(both) > 1 else None
        mean, half, weight = intervals(of, spread)
        conditions = of.real.shape[1]
        std = of.real.std(axis=1, ddof=1)
        alone_half = t.ppf(0.975, conditions - 1) * std / np.sqrt(conditions)
        off = of.real.mean(axis=1) - true, mean - true
        parts.append(np.array([*off, alone_half, half, weight]))
    alone_off, assisted_off, alone_half, assisted_half, weight = np.hstack(parts)
    return {
        "alone": np.mean(np.abs(alone_off) <= alone_half),
        "assisted": np.mean(np.abs(assisted_off) <= assisted_half),
        "alone_half": np.median(alone_half),
        "assisted_half": np.median(assisted_half),
        "weight": np.mean(weight),
        "rms_error": np.sqrt(np.mean(assisted_off**2)),
    }


def cover(systems: Mapping[str, pandas.DataFrame], resamples: int) -> Iterator[dict[str, Any]]:
    """Yield the coverage of every case, metric, size of sample, and manager or pair."""
    groups = [*((name,) for name in MANAGERS), *PAIRS]
    for metric in METRICS:
        cases = list(cases_of({name: system_of(each, metric) for name, each in systems.items()}))
        for case in cases if metric == "search_time_s" else cases[:OF_ALL_METRICS]:
            for both in groups:
                for size in SAMPLES:
                    row = {"case": case.name, "metric": metric, "group": both[0]}
                    row |= {"other": "".join(both[1:]), "conditions": size[0], "runs_each": size[1]}
                    row |= {"is_beyond": case.is_beyond}
                    yield row | coverage(case, both, size, resamples)


# Gains


def gains(same: CampaignFrame, population: pandas.DataFrame) -> pandas.DataFrame:
    """Compare parts of the real missions, one to five under each of the six conditions, with all of
    them.

    Returns:
        A row for each manager, metric and number of runs: the medians over parts that share no
        mission of estimates, half-widths and weight.
    """
    real = pandas.read_csv(REAL).drop(columns="run")
    real = real[real["manager"].isin(MANAGERS)]
    real["place"] = real.groupby(["manager", "condition"]).cumcount()
    rows = []
    for runs_each in (1, 2, 5):
        for first in range(0, 6 - runs_each, runs_each):
            part = real[real["place"].between(first, first + runs_each - 1)].drop(columns="place")
            found = same.assist(part, population, metrics=METRICS).estimates
            for name in ("alone", "assisted"):
                ends = found[f"{name}_ci95_low"], found[f"{name}_ci95_high"]
                found[f"{name}_half"] = (ends[1] - ends[0]) / 2.0
            rows.append(found)
    columns = ["alone", "alone_half", "assisted", "assisted_half", "weight"]
    by = ["metric", "group", "other", "runs"]
    return pandas.concat(rows).groupby(by, sort=False)[columns].median().reset_index()


def under_real_conditions(runs: int, workers: int) -> CampaignFrame:
    """Run missions under the six conditions of the real ones."""
    return run_campaign(
        "planta_exp1_campaign",
        MANAGERS,
        runs=runs,
        seed=studies.SEED,
        workers=workers,
        progress=False,
    )


def population_of(workers: int) -> pandas.DataFrame:
    """Run missions under many conditions, drawn as those of the real ones."""
    return run_campaign(
        SCENARIO,
        MANAGERS,
        runs=500,
        seed=2,
        workers=workers,
        progress=False,
        perturbations=DRAWN,
    )


# What it shows


def conclude(covered: pandas.DataFrame, gained: pandas.DataFrame) -> str:
    """Say what the tables show."""
    covered = covered.assign(other=covered["other"].fillna(""))
    gained = gained.assign(other=gained["other"].fillna(""))
    within = covered[~covered["is_beyond"]]
    lines = [
        f"- Intervals hold the true mean in {within['assisted'].min():.1%} of the samples or more; those of the real"
        f" missions alone in {within['alone'].min():.1%} or more."
    ]
    for name, rows in covered[covered["is_beyond"]].groupby("case", sort=False):
        least = rows.loc[rows["assisted"].idxmin()]
        whose = f"{least['group']} - {least['other']}" if least["other"] else least["group"]
        lines.append(
            f"- Beyond what they allow for, {name}: {least['assisted']:.1%} at worst ({whose},"
            f" {least['conditions']} conditions; alone {least['alone']:.1%})."
        )
    lines += ["", *table_of(within[within["metric"] == "search_time_s"]), ""]
    own = within[(within["metric"] == "search_time_s") & (within["case"] == "other parameters")]
    for row in own[(own["runs_each"] == 1) & own["conditions"].isin([6, 12, 30])].itertuples():
        whose = f"{row.group} - {row.other}" if row.other else row.group
        lines.append(
            f"- {whose}, search time, {row.conditions} conditions: alone ± {row.alone_half:.1f} s, assisted ±"
            f" {row.assisted_half:.1f} s"
        )
    for row in gained[gained["runs"].isin([6, 30]) & (gained["other"] == "")].itertuples():
        unit = "s" if row.metric == "search_time_s" else "m"
        lines.append(
            f"- exp1, {row.group}, {row.metric}, {row.runs} real runs: alone {row.alone:.1f} ± {row.alone_half:.1f}"
            f" {unit}, assisted {row.assisted:.1f} ± {row.assisted_half:.1f} {unit}, weight {row.weight:.0f}"
        )
    return "\n".join(lines)


def table_of(within: pandas.DataFrame) -> Iterator[str]:
    """Yield the lines of a table of search times: how often intervals hold the mean at least, with
    the half-width for bt.
    """
    sizes = [conditions for conditions, runs_each in SAMPLES if runs_each == 1]
    yield f"| case | {' | '.join(f'{size} conditions' for size in sizes)} |"
    yield f"| --- |{' ---: |' * len(sizes)}"
    single = within[within["runs_each"] == 1]
    is_pair = single["other"] != ""
    parts = [(name, "assisted", rows) for name, rows in single.groupby("case", sort=False)]
    parts.append(("real missions alone, one manager", "alone", single[~is_pair]))
    parts.append(("real missions alone, two managers", "alone", single[is_pair]))
    for name, side, rows in parts:
        cells = []
        for _, own in rows.groupby("conditions"):
            cell = f"{own[side].min():.1%}"
            of_bt = own.loc[(own["group"] == "bt") & (own["other"] == ""), f"{side}_half"]
            cells.append(f"{cell} ({of_bt.median():.0f} s)" if len(of_bt) else cell)
        yield f"| {name} | {' | '.join(cells)} |"


def draw(figure: Figure, covered: pandas.DataFrame) -> None:
    """Draw coverage and half-widths of the search time's intervals, those of managers, by case."""
    is_drawn = (covered["metric"] == "search_time_s") & covered["other"].fillna("").eq("")
    own = covered[is_drawn & (covered["runs_each"] == 1)]
    cases = list(own["case"].unique())
    left, right = figure.subplots(1, 2, sharey=True)
    for side, colour, shift in (("alone", studies.GREY, 0.15), ("assisted", studies.BLUE, -0.15)):
        places = [len(cases) - cases.index(case) + shift for case in own["case"]]
        left.plot(100.0 * own[side], places, "o", ms=3.0, color=colour, alpha=0.6)
        right.plot(own[f"{side}_half"], places, "o", ms=3.0, color=colour, alpha=0.6, label=side)
    left.axvline(95.0, color=studies.GREY, lw=0.7, ls=":")
    left.set(xlabel="intervals that hold the mean (%)")
    left.set_yticks([len(cases) - place for place in range(len(cases))], cases)
    right.set(xlabel="half-width (s)", xscale="log")
    right.set_xticks([10, 20, 50], ["10", "20", "50"])
    right.set_xticks([], minor=True)
    right.legend(loc="upper right")


def options() -> argparse.Namespace:
    """Read the options."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(""))
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--resamples", type=int, default=RESAMPLES)
    return parser.parse_args()


def write(out: Path, covered: pandas.DataFrame, gained: pandas.DataFrame) -> None:
    """Write tables, and figure and conclusion as they follow from them; print the conclusion."""
    out.mkdir(parents=True, exist_ok=True)
    tables = {"coverage": covered, "gains": gained}
    for name, table in tables.items():
        table.to_csv(out / f"{name}.csv", index=False, float_format="%.4g", lineterminator="\n")
    written = [pandas.read_csv(out / f"{name}.csv") for name in tables]
    studies.figure_of(draw, written[0], height=3.2).savefig(out / "assisted.png", dpi=160)
    conclusion = conclude(*written)
    (out / "conclusion.md").write_text(conclusion + "\n", encoding="utf-8")
    print(conclusion)


def main() -> None:
    """Run the study."""
    chosen = options()
    covered = pandas.DataFrame(cover(simulate_all(chosen.workers), chosen.resamples))
    same = under_real_conditions(chosen.runs, chosen.workers)
    write(chosen.out, covered, gains(same, population_of(chosen.workers)))


if __name__ == "__main__":
    main()
