"""Missions of several sources: read from folders, files or a data frame, and grouped for a comparison or a figure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas
from numpy.typing import NDArray

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.files import as_number
from suave_des.records.metrics import DISTANCE, FOUND, METRICS, REACTION_TIME, SEARCH_TIME, Metric, metric_of
from suave_des.records.runs import COLUMNS, is_foreign, read_runs
from suave_des.records.store import RUNS_FILE, STORE_FILE, read_manifest

_USUAL = (SEARCH_TIME, DISTANCE, FOUND, REACTION_TIME)
SHARING = "runs_sharing_draw"
"""Column of missions, and attribute of a frame: how many runs in a row share their draws."""
PAPER_ORDER = {"none": 0, "random": 1, "metacontrol": 2}
_MOST_GROUPS = 60
"""More make tables that nobody reads, and thousands of tests."""
_MEMBER = "ensemble_member"
"""Column of runs.csv: the parameter set of a run."""
_FEW = 20
SAME_LIMIT_S = 1.5
"""Programs write limits that differ by a second for the same one."""


@dataclass(frozen=True)
class Missions:
    """Missions to compare, a row for each.

    Attributes:
        frame: with `source`, the columns of records.runs.COLUMNS, further metrics, and what a sweep varies; with
            `runs_sharing_draw` where that is known.
        swept: columns that a sweep varies.
        notes: what readers of the comparison should know about the files.
        folders: of the campaigns that can be run again, by source.
    """

    frame: pandas.DataFrame
    swept: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    folders: Mapping[str, Path] = field(default_factory=dict)

    def check_swept(self, names: Sequence[str], place: str) -> None:
        """Check that a sweep varies these columns.

        Raises:
            InputError: it does not vary one of them; `place` says where that was asked for.
        """
        for name in names:
            if name not in self.swept:
                remedy = did_you_mean(name, self.swept, "swept are")
                raise InputError(f"{shown(name)} is not what a sweep varies here", place=place, remedy=remedy)


def _checked(missions: Missions, path: Path | None = None) -> Missions:
    """Return missions none of which is there twice."""
    known = missions.frame[missions.frame["run"].notna() & (missions.frame["seed"] != "")]
    twice = known.duplicated(["manager", "seed", "run", *missions.swept])
    if twice.any():
        row = known[twice].iloc[0]
        problem = f"run {row['run']:.0f} of {row['manager']} with seed {row['seed']} is there twice"
        raise InputError(problem, file=path, remedy="give each mission once")
    return missions


def read_missions(paths: Sequence[Path]) -> Missions:
    """Read the missions in folders or files of results.

    Args:
        paths: folders of `suave-des campaign` or `reproduce`, of the exemplar's own CSV files, or single CSV files.

    Raises:
        InputError: one of them has no missions, is given twice, or has missions of several scenarios.
    """
    if not paths:
        raise InputError("no results are given", remedy="give the --out folders of suave-des campaign, or CSV files")
    resolved = [path.resolve() for path in paths]
    for place, path in enumerate(paths):
        if resolved[place] in resolved[:place]:
            raise InputError("is given twice", file=path, remedy="name each folder of results once")
    sources = [_read_source(path) for path in paths]
    names = _short_names(paths)
    frames = [each.frame.assign(source=name) for each, name in zip(sources, names, strict=True)]
    swept = tuple(dict.fromkeys(name for source in sources for name in source.swept))
    notes = tuple(note for source in sources for note in source.notes)
    folders = {name: path for name, path in zip(names, paths, strict=True) if (path / STORE_FILE).is_file()}
    return Missions(pandas.concat(frames, ignore_index=True), swept, notes, folders)


def missions_of(frame: pandas.DataFrame) -> Missions:
    """Take the missions of a data frame with the columns of runs.csv, as run_campaign returns it or pandas reads it.

    Raises:
        InputError: it has no missions, lacks a column, or has a mission twice.
    """
    for column in ("manager", SEARCH_TIME, DISTANCE):
        if column not in frame.columns:
            raise InputError(f"the data frame has no column {column!r}", remedy="it needs the columns of runs.csv")
    if frame.empty:
        raise InputError("the data frame has no missions", remedy="one row for each mission is needed")
    plain = pandas.DataFrame(frame).reset_index(drop=True)
    texts = ("scenario", "manager", "seed")
    missing = {name: "" if name in texts else math.nan for name in COLUMNS if name not in plain}
    plain = plain.assign(**missing, source="", **{SHARING: int(frame.attrs.get(SHARING, 1))})
    plain = plain.assign(**{name: plain[name].astype(str) for name in texts})
    numbers = [str(name) for name in plain if name == "run" or (name not in texts and metric_of(str(name)))]
    try:
        plain = plain.astype(dict.fromkeys(numbers, "Float64")).astype(dict.fromkeys(numbers, float))
    except (ValueError, TypeError) as error:
        problem = f"the data frame's columns of metrics have something that is no number: {error}"
        raise InputError(problem, remedy="it needs the columns of runs.csv") from None
    return _checked(Missions(plain, _swept({}, plain)))


def _read_source(path: Path) -> Missions:
    manifest = read_manifest(path if path.is_dir() else path.parent)
    if not path.is_dir():
        return _read_file(path, manifest)
    if (path / RUNS_FILE).exists():
        found = _read_file(path / RUNS_FILE, manifest)
        frame = found.frame.assign(**{SHARING: _sharing(manifest)})
        return Missions(frame, found.swept, (*found.notes, *_unfinished(path, manifest)))
    if (path / STORE_FILE).is_file():
        remedy = f"suave-des campaign --resume {path} runs the rest and writes them"
        raise InputError("the campaign ended before its result files were written", file=path, remedy=remedy)
    return _read_exemplars_folder(path)


def _read_file(path: Path, manifest: Mapping[str, Any] = MappingProxyType({})) -> Missions:
    """Read one file, with the manifest of its campaign."""
    runs = read_runs(path)
    runs.check_simulated()
    frame = runs.frame.reset_index(drop=True)
    if frame["scenario"].iloc[0]:
        return _checked(Missions(frame, _swept(manifest, frame), runs.notes), path)
    return _checked(Missions(in_papers_order(frame), (), runs.notes), path)


def in_papers_order(frame: pandas.DataFrame) -> pandas.DataFrame:
    """Sort real missions by manager as in the paper's table, others after these in their own order."""
    ranks = frame["manager"].map(PAPER_ORDER).fillna(len(PAPER_ORDER))
    return frame.iloc[ranks.argsort(kind="stable")].reset_index(drop=True)


def _read_exemplars_folder(folder: Path) -> Missions:
    """Read all CSV files of a folder that are results; others, such as the exemplar's statistics, are left out."""
    paths = sorted(folder.glob("*.csv"))
    own = [path for path in paths if not is_foreign(path)] or paths[:1]
    if not own:
        remedy = "give the --out folder of suave-des campaign, or a folder with the exemplar's CSV files"
        raise InputError("has no result files" if folder.exists() else "no such folder", file=folder, remedy=remedy)
    found = [_read_file(path) for path in own]
    notes = [f"{path} is left out: it has no columns of missions" for path in paths if path not in own]
    notes += [note for each in found for note in each.notes]
    frame = pandas.concat([each.frame for each in found], ignore_index=True)
    return Missions(in_papers_order(frame), (), tuple(notes))


def _sharing(manifest: Mapping[str, Any]) -> int:
    """Return how many runs in a row share the draws of perturbations; 1 if none do."""
    try:
        return max(1, int(manifest["runs_per_draw"])) if manifest["perturbations"] else 1
    except (ValueError, KeyError, TypeError):
        return 1


def _unfinished(folder: Path, manifest: Mapping[str, Any]) -> Iterator[str]:
    """Say how many missions a campaign lacks."""
    with suppress(ValueError, KeyError, TypeError):
        left_out, failed, planned = (int(manifest["missions"][key]) for key in ("left_out", "failed", "planned"))
        if left_out or failed:
            yield (
                f"{folder}: of {planned} missions {left_out} are missing and {failed} failed;"
                f" suave-des campaign --resume {folder} runs those that are missing"
            )


def _swept(manifest: Mapping[str, Any], frame: pandas.DataFrame) -> tuple[str, ...]:
    """Return the columns that a sweep varies: those that the manifest names, or else those that seem to vary.

    These differ between missions of one manager, seed and run, and are no metrics.
    """
    columns = [str(name) for name in frame if name not in COLUMNS and metric_of(str(name)) is None]
    if "missions" in manifest:
        with suppress(AttributeError, TypeError):
            forms = manifest.get("sweep", {})
            ranges = (forms.get("sample") or {}).get("ranges", {})
            named = [name for form in (forms.get("grid", {}), forms.get("zip", {}), ranges) for name in form]
            return tuple(name for name in named if name in columns)
    if not columns or frame["run"].isna().any():
        return ()
    counts = frame.groupby(["manager", "seed", "run"], sort=False, observed=True)[columns].nunique(dropna=False)
    return tuple(name for name in columns if (counts[name] > 1).any())


def _short_names(paths: Sequence[Path]) -> list[str]:
    """Name sources by the last parts of their paths that tell them apart."""
    parts = [path.resolve().with_suffix("").parts for path in paths]
    for depth in range(1, max(map(len, parts))):
        names = ["/".join(each[-depth:]) for each in parts]
        if len(set(names)) == len(names):
            return names
    return [str(path) for path in paths]


# Groups


@dataclass(frozen=True, eq=False)
class Group:
    """Missions that are compared with those of other groups.

    Attributes:
        name: the manager's, with its source or its value of a sweep where several have the same.
        frame: a row for each independent value: for each mission, or, where points of a sweep are averaged, for each
            run, whose random numbers all points share; or for each draw that several runs share.
        is_of_missions: whether each row is one mission.
        point: the end of the name that tells the value of a sweep; empty if all values are in the group.
    """

    name: str
    frame: pandas.DataFrame
    is_of_missions: bool = True
    point: str = ""

    def values(self, metric: str) -> NDArray[np.float64]:
        """Return the values of a metric, nan where there is none."""
        return self.frame[metric].to_numpy(float)

    def known_values(self, metric: str) -> NDArray[np.float64]:
        """Return the values of a metric without missing ones; empty if it is not there at all."""
        return self.frame[metric].dropna().to_numpy(float) if metric in self.frame else np.empty(0)

    def by_run(self, metric: str) -> pandas.Series[float] | None:
        """Return the values by (seed, run); None for missions without these."""
        if self.frame["run"].isna().any() or (self.frame["seed"] == "").any():
            return None
        return pandas.Series(self.values(metric), self._runs)

    @cached_property
    def _runs(self) -> pandas.MultiIndex:
        return pandas.MultiIndex.from_frame(self.frame[["seed", "run"]])


def least_and_greatest(values: pandas.Series[float]) -> list[tuple[float, int]]:
    """Return the least and the greatest of values by (seed, run), each with its run."""
    runs = values.index.get_level_values("run")
    return [(float(values.iloc[at]), int(runs[at])) for at in (int(values.argmin()), int(values.argmax()))]


def counted(groups: Sequence[Group]) -> str:
    """Return what the rows of groups are: "mission", "run", "draw", or "value" where they differ."""
    kinds = {group.is_of_missions for group in groups}
    if kinds == {False}:
        return "draw" if any(runs_sharing_draw(group.frame) > 1 for group in groups) else "run"
    return "mission" if kinds == {True} else "value"


def time_limit_s(groups: Sequence[Group]) -> int:
    """Return the whole seconds that missions of every group had; where all found the pipeline, the longest search."""
    lost = [group.frame.loc[group.frame[FOUND] == 0.0, SEARCH_TIME] for group in groups]
    limits_s = [float(times.max()) for times in lost if times.notna().any()]
    ends_s = [float(times_s.max()) for group in groups if len(times_s := group.known_values(SEARCH_TIME))]
    limit_s = min(limits_s) if limits_s else max(ends_s, default=0.0)
    return math.floor(limit_s) or math.ceil(limit_s)


def grouped(
    missions: Missions, managers: Sequence[str] = (), by: Sequence[str] = (), *, averages: bool = True
) -> tuple[list[Group], list[str]]:
    """Group missions by manager, source and the chosen parameters of a sweep.

    Args:
        missions: of all sources.
        managers: names of the managers to include; empty: all.
        by: swept parameters each of whose values is a separate group.
        averages: whether a run's values are averaged over the other swept parameters.

    Returns:
        The groups in the order of their first missions, and notes for the reader.

    Raises:
        InputError: a name is not there, or there are too many groups.
    """
    frame, known = missions.frame, list(dict.fromkeys(missions.frame["manager"]))
    for name in managers:
        if name not in known:
            raise InputError(f"there is no mission of {shown(name)}", remedy=did_you_mean(name, known, "there are"))
    missions.check_swept(by, "by")
    if managers:
        frame = frame[frame["manager"].isin(managers)]
    found = list(frame.groupby(["manager", "source", *by], sort=False, dropna=False, observed=True))
    if managers:
        found.sort(key=lambda item: list(managers).index(str(item[0][0])))
    if len(found) > _MOST_GROUPS:
        problem = f"{len(found)} groups are too many to compare with each other"
        raise InputError(problem, remedy=f"choose {_MOST_GROUPS} or fewer with managers and by")
    averaged = [name for name in missions.swept if averages and name not in by]
    names = _names([key for key, _ in found], by)
    alike = _alike_by_source(frame) if averages else {}
    points = {
        key: len(part[averaged].drop_duplicates()) if averaged else 1
        for key, part in frame.groupby(["source", *by], dropna=False, observed=True)
    }
    groups, lacking = [], []
    for (name, end), (key, part) in zip(names, found, strict=True):
        source, number = str(key[1]), points[key[1:]]
        rows = _means(part, number) if number > 1 else part
        if number > 1 and (left := len(part.groupby(["seed", "run"], observed=True)) - len(rows)):
            lacking.append(f"{name} {left} of {left + len(rows)}")
        if (sharing := alike.get(source, 1)) > 1:
            whole = frame[frame["source"] == source]  # how many runs of a draw there are under any manager
            draws = whole.groupby(["seed", first_alike(whole, sharing)], observed=True)["run"].nunique()
            rows = _means(rows.assign(run=first_alike(rows, sharing)), draws)
        groups.append(Group(name, rows, number == sharing == 1, end))
    if lacking and not any(len(group.frame) for group in groups):
        remedy = f"compare the points with --by {','.join(averaged)}, or resume the campaign"
        raise InputError("no manager has a run with missions at all points of the sweep", remedy=remedy)
    notes = list(_notes(groups, averaged, frame, alike))
    if lacking:
        notes.append(f"runs that lack a point of the sweep ({', '.join(lacking)}) are left out")
    return groups, notes


def _names(keys: Sequence[tuple[object, ...]], by: Sequence[str]) -> list[tuple[str, str]]:
    """Return of each group the name, and the end of it that tells the values of a sweep."""
    sources: dict[object, set[object]] = {}
    for manager, source, *_ in keys:
        sources.setdefault(manager, set()).add(source)
    ends = [name.rpartition(".")[2] for name in by]
    labels = ends if len(set(ends)) == len(ends) else by
    names = []
    for manager, source, *values in keys:
        texts = (f"{value:g}" if isinstance(value, float) else printable(str(value)) for value in values)
        point = "".join(f", {label} {text}" for label, text in zip(labels, texts, strict=True))
        of_source = f" ({printable(str(source))})" if len(sources[manager]) > 1 else ""
        names.append((f"{printable(str(manager))}{of_source}{point}", point))
    return names


# What to compare


def chosen_metrics(wanted: Sequence[str], groups: Sequence[Group]) -> tuple[Metric, ...]:
    """Return the metrics to compare: those named, or those of the usual ones that at least one mission has.

    Raises:
        InputError: there is no such metric, or no mission has it.
    """
    found = []
    for name in dict.fromkeys(wanted or _USUAL):
        metric = metric_of(name)
        if metric is None:
            remedy = did_you_mean(name, METRICS, "there are")
            raise InputError(f"there is no metric {shown(name)}", place="metrics", remedy=remedy)
        if any(len(group.known_values(name)) for group in groups):
            found.append(metric)
        elif wanted:
            raise InputError(f"no mission has a value of {name}", place="metrics", remedy="leave it out")
    return tuple(found)


def read_half_widths(texts: Sequence[str], metrics: Sequence[Metric]) -> dict[str, float]:
    """Read METRIC:HALF_WIDTH, for instance search_time_s:2, by the metric.

    Raises:
        InputError: the metric is not compared, or the half-width is no number above 0.
    """
    names = [metric.name for metric in metrics]
    found = {}
    for text in texts:
        name, _, number = (part.strip() for part in text.partition(":"))
        if name not in names or not 0.0 < as_number(number) < math.inf:
            remedy = f"give METRIC:HALF_WIDTH, such as {names[0]}:2; metrics are {', '.join(names)}"
            problem = f"{shown(text)} is no half-width above 0 of what is compared"
            raise InputError(problem, place="half-width", remedy=remedy)
        found[name] = as_number(number)
    return found


# Runs that share their draws


def runs_sharing_draw(frame: pandas.DataFrame) -> int:
    """Return how many runs in a row share their draws; of several campaigns, as many as have whole draws of each."""
    return math.lcm(*frame[SHARING].dropna().astype(int).unique()) if SHARING in frame else 1


def first_alike(frame: pandas.DataFrame, alike: int) -> pandas.Series[float]:
    """Return of each mission the first run that shares its draws."""
    return (frame["run"] - 1) // alike * alike + 1


def _alike_by_source(frame: pandas.DataFrame) -> dict[str, int]:
    """Return by source how many runs are averaged, because some share a draw.

    Campaigns are compared run by run, and so by means over the same runs. Other sources, such as real missions, are not
    averaged.
    """
    are_runs = (frame["run"].notna() & (frame["seed"] != "")).groupby(frame["source"], observed=True).all()
    return dict.fromkeys(map(str, are_runs.index[are_runs]), runs_sharing_draw(frame))


def _means(frame: pandas.DataFrame, wanted: int | pandas.Series[int]) -> pandas.DataFrame:
    """Average rows of the same seed and run.

    A mean over other points, or other runs of a draw, than that of another manager would compare these points and not
    the managers. So a metric is missing where not all of the wanted rows have a value; a row is left out where a
    whole mission is missing.

    Args:
        frame: rows to average.
        wanted: how many rows each run has where none is missing.
    """
    numbers = list(frame.select_dtypes("number").columns.difference(["run"]))
    by_run = frame.groupby(["seed", "run"], sort=False, observed=True)
    sizes = by_run.size()
    whole = sizes * 0 + wanted if isinstance(wanted, int) else wanted.reindex(sizes.index)
    means = by_run[numbers].mean().where(by_run[numbers].count().eq(whole, axis=0))
    return means[sizes == whole].reset_index()


# What a reader should know


def _notes(
    groups: Sequence[Group], averaged: Sequence[str], frame: pandas.DataFrame, alike_by_source: Mapping[str, int]
) -> Iterator[str]:
    if (alike := max(alike_by_source.values(), default=1)) > 1:
        is_one = frame.loc[frame["source"].isin(list(alike_by_source)), SHARING].eq(alike).all()
        what = f"the {alike} runs that share each draw" if is_one else f"every {alike} runs, of which some share a draw"
        others = len(alike_by_source) < frame["source"].nunique()
        of = f" of {', '.join(map(printable, alike_by_source))}" if others else ""
        yield (
            f"the values of {what} (runs_per_draw){of} are averaged: draws are independent, and runs are not; n and the"
            f" runs needed{of and ' there'} are numbers of {'draws' if is_one else 'these averages'}"
        )
    if averaged and not all(group.is_of_missions for group in groups):
        yield (
            f"the values of a run are averaged over {', '.join(averaged)}: all points of a sweep share its random"
            " numbers, so that runs are independent and missions are not"
        )
    members = frame[_MEMBER].nunique() if _MEMBER in frame else 0
    if members > 1:
        yield (
            f"runs have {members} sets of parameters (an ensemble): intervals and tests are for chance among runs with"
            " these sets; how much the sets differ is in ensemble.csv"
        )
    if len(scenarios := set(frame["scenario"]) - {""}) > 1:
        yield f"the missions are of different scenarios: {', '.join(sorted(scenarios))}"
    few = min(len(group.frame) for group in groups)
    if few < _FEW:
        rough = f"intervals and numbers of runs needed from fewer than {_FEW} are rough"
        yield f"the fewest runs of one of them are {few}: {rough}"
    if any(not len(group.known_values(FOUND)) for group in groups):
        yield "some files do not say which missions found the pipeline"


def caveats(groups: Sequence[Group], metrics: Sequence[Metric]) -> Iterator[str]:
    """Yield what is to be known of missions that never found the pipeline, and of those without a value of a metric."""
    for metric in metrics:
        if metric.name == SEARCH_TIME:
            yield from _never_found(groups)
        elif metric.name != FOUND:
            yield from _left_out(groups, metric)


def mostly_lost(groups: Sequence[Group]) -> str:
    """Say which groups did not find the pipeline in most of their missions; empty if all found it in half of them."""
    lost = [(group, 1.0 - group.known_values(FOUND)) for group in groups if len(group.known_values(FOUND))]
    counts = [
        f"{group.name} in "
        + (f"{shares.sum():.0f} of {len(shares)}" if group.is_of_missions else f"{shares.mean():.0%} of its")
        + " missions"
        for group, shares in lost
        if shares.mean() > 0.5
    ]
    what = "their search time is when they ended"
    return f"The pipeline was not found by {listed(counts)}; {what}. " if counts else ""


def _never_found(groups: Sequence[Group]) -> Iterator[str]:
    counts, ends = [], []
    for group in groups:
        is_lost = group.values(FOUND) < 1.0
        if is_lost.any() and group.is_of_missions:
            times_s = group.values(SEARCH_TIME)[is_lost]
            counts.append(f"{group.name} {len(times_s)} of {len(is_lost)}")
            ends.append((group.name, times_s.min(), times_s.max()))
        elif is_lost.any():
            counts.append(f"{group.name} {1.0 - np.nanmean(group.values(FOUND)):.1%}")
    ended = f"the search time of missions that never found the pipeline ({listed(counts)}) is the time at which they"
    if ends and max(high for *_, high in ends) - min(low for _, low, _ in ends) > SAME_LIMIT_S:
        times = [f"{name} after {low:.0f}{f' to {high:.0f}' if high > low else ''} s" for name, low, high in ends]
        yield (
            f"{ended} ended, which differs ({listed(times)}): a mission that ends early counts as a short search, and"
            " means, differences and tests of the search time do not compare it; compare the share that found it"
        )
    elif counts:
        yield f"{ended} ended: a mean search time is the mean up to that limit, and would be longer without it"


def _left_out(groups: Sequence[Group], metric: Metric) -> Iterator[str]:
    known = [(group, len(group.known_values(metric.name))) for group in groups]
    counts = [
        f"{group.name} {len(group.frame) - n} of {len(group.frame)}" for group, n in known if 0 < n < len(group.frame)
    ]
    if counts:
        what = "missions" if all(group.is_of_missions for group in groups) else "missions, or averages over missions,"
        without = f"{what} without a {metric.title} ({listed(counts)})"
        yield f"{without} are left out of it; they may be those that went worst"


def printable(name: str) -> str:
    """Return a name from a file without terminal control characters."""
    return name if name.isprintable() else repr(name)[1:-1]


def listed(parts: Sequence[str], most: int = 6) -> str:
    """Write the first of several parts, and how many more there are."""
    more = len(parts) - most
    return ", ".join(parts[:most]) + (f" and {more} more" if more > 0 else "")
