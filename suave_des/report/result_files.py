"""Gather the missions to compare, from results folders, single files or a data frame."""

from __future__ import annotations

import csv
import json
import math
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, fields
from pathlib import Path

import pandas

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.metrics.result import MissionMetrics
from suave_des.report.runs import COLUMNS, read_runs

OWN_COLUMNS = tuple(field.name for field in fields(MissionMetrics))
"""Columns of runs.csv that every campaign has."""
PAPER_ORDER = {"none": 0, "random": 1, "metacontrol": 2}
_MORE_METRICS = ("adaptations", "mission_duration_s", "detection_time_s", "detection_y_m")
"""Columns of runs.csv that are read where they are there, besides those of every file."""
_RUNS_FILE, _STORE_FILE, _MANIFEST_FILE = "runs.csv", "campaign.sqlite", "manifest.json"


@dataclass(frozen=True)
class Missions:
    """Missions to compare, a row for each.

    Attributes:
        frame: with `source`, `manager`, `scenario`, the columns of report.runs.COLUMNS, and those of a sweep; with
            `runs_sharing_draw`, how many runs in a row share their draws, where that is known.
        swept: columns that a sweep varies: they differ between missions of one manager, seed and run.
        notes: caveats about the files for readers of the comparison.
    """

    frame: pandas.DataFrame
    swept: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def check_swept(self, names: Sequence[str], place: str) -> None:
        """Check that a sweep varies these columns.

        Raises:
            InputError: it does not vary one of them; `place` says where that was asked for.
        """
        for name in names:
            if name not in self.swept:
                remedy = did_you_mean(name, self.swept, "swept are")
                raise InputError(f"{shown(name)} is not what a sweep varies here", place=place, remedy=remedy)


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
    frames = [source.frame.assign(source=name) for source, name in zip(sources, names, strict=True)]
    swept = tuple(dict.fromkeys(name for source in sources for name in source.swept))
    notes = tuple(note for source in sources for note in source.notes)
    return Missions(pandas.concat(frames, ignore_index=True), swept, notes)


def missions_of(frame: pandas.DataFrame) -> Missions:
    """Take the missions of a data frame with the columns of runs.csv, as run_campaign returns it or pandas reads it.

    Raises:
        InputError: it has no missions, or lacks a column.
    """
    for column in ("manager", "search_time_s", "distance_inspected_m"):
        if column not in frame.columns:
            raise InputError(f"the data frame has no column {column!r}", remedy="it needs the columns of runs.csv")
    if frame.empty:
        raise InputError("the data frame has no missions", remedy="one row for each mission is needed")
    plain = pandas.DataFrame(frame).reset_index(drop=True)
    missing = {name: "" if name == "seed" else float("nan") for name in COLUMNS if name not in plain}
    plain = plain.assign(**missing, source="")
    plain["manager"] = plain["manager"].astype(str)
    plain["seed"] = plain["seed"].astype(str)
    plain["scenario"] = plain["scenario"].astype(str) if "scenario" in plain else ""
    for name in ("pipeline_found", "mean_reaction_time_s", "run"):
        plain[name] = _as_floats(plain[name])
    others = [name for name in frame.columns if name not in OWN_COLUMNS]
    missions = Missions(
        plain.assign(runs_sharing_draw=int(frame.attrs.get("runs_sharing_draw", 1))), _varying(plain, others)
    )
    _check_once(missions, None)
    return missions


def _header(path: Path) -> list[str]:
    with path.open(encoding="utf-8-sig", newline="") as file:
        return [name.strip() for name in next(csv.reader(file), [])]


def _read_source(path: Path) -> Missions:
    if not path.is_dir():
        return _of_runs(path)
    check_one_campaign(path)
    if (path / _RUNS_FILE).is_file():
        missions = _of_runs(path / _RUNS_FILE)
        frame = missions.frame.assign(runs_sharing_draw=_runs_sharing_draw(path))
        return Missions(frame, missions.swept, tuple(_unfinished(path)))
    if (path / _STORE_FILE).is_file():
        remedy = f"suave-des campaign --resume {path} runs the rest and writes them"
        raise InputError("the campaign ended before its result files were written", file=path, remedy=remedy)
    return _read_exemplar_folder(path)


def check_one_campaign(folder: Path) -> None:
    """Check that the result files of a folder are of the campaign whose missions are kept in it, as far as both say so.

    Raises:
        InputError: they are of another campaign.
    """
    try:
        written = json.loads((folder / _MANIFEST_FILE).read_text(encoding="utf-8"))["campaign_sha256"]
        address = (folder / _STORE_FILE).absolute().as_uri()
        with closing(sqlite3.connect(f"{address}?mode=ro", uri=True)) as store:
            (kept,) = store.execute("SELECT value FROM about WHERE name = 'identity'").fetchone()
        is_one = json.loads(kept) == written
    except (OSError, ValueError, KeyError, TypeError, RecursionError, sqlite3.Error):
        return
    if not is_one:
        remedy = f"suave-des campaign --resume {folder} writes those of the campaign that is kept there"
        raise InputError(f"{_RUNS_FILE} and {_STORE_FILE} are of different campaigns", file=folder, remedy=remedy)


def _of_runs(path: Path) -> Missions:
    """Read one file; of a runs.csv with the columns that are not metrics, too."""
    try:
        header = _header(path) if path.is_file() else []
    except (OSError, ValueError):
        header = []  # read_runs says what is wrong
    is_own = "manager" in header
    others = [name for name in header if name not in OWN_COLUMNS] if is_own and "scenario" in header else []
    runs = read_runs(path, further=others, where_present=_MORE_METRICS, are_simulated="scenario" in header)
    runs.check_simulated((), None)
    found = _as_floats(runs.frame["pipeline_found"])
    more = {name: _as_floats(pandas.to_numeric(runs.frame[name])) for name in _MORE_METRICS if name in runs.frame}
    frame = runs.frame.assign(scenario=next(iter(runs.scenarios), ""), pipeline_found=found, **more)
    missions = Missions(frame if runs.scenarios else _in_paper_order(frame), _varying(runs.frame, others))
    _check_once(missions, path)
    return missions


def _as_floats(column: pandas.Series) -> pandas.Series[float]:
    """Return numbers, or 1 for true and 0 for false; nan where there is no value."""
    return pandas.Series(column.astype("Float64").to_numpy(float, na_value=math.nan), column.index)


def _in_paper_order(frame: pandas.DataFrame) -> pandas.DataFrame:
    """Sort real missions as the paper's table has their managers; others come after these, in their own order."""
    ranks = frame["manager"].map(PAPER_ORDER).fillna(len(PAPER_ORDER))
    return frame.iloc[ranks.argsort(kind="stable")].reset_index(drop=True)


def _read_exemplar_folder(folder: Path) -> Missions:
    """Read all CSV files of a folder that are results; others, such as the exemplar's statistics, are left out."""
    frames, notes, errors = [], [], []
    try:
        paths = sorted(folder.glob("*.csv"))
        inner = sorted(child.name for child in folder.iterdir() if (child / _RUNS_FILE).is_file())
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=folder, remedy="check its rights") from None
    for path in paths:
        try:
            frames.append(_of_runs(path).frame)
        except InputError as error:
            if not _is_foreign(path):
                raise
            errors.append(error)
            notes.append(f"{path} is left out: it has no columns of missions")
    if frames:
        frame = _in_paper_order(pandas.concat(frames, ignore_index=True))
        return Missions(frame, (), tuple(notes))
    if errors:
        raise errors[0]
    if inner:
        names = " ".join(str(folder / name) for name in inner[:4])
        raise InputError("has no results itself", file=folder, remedy=f"give the folders in it: {names}")
    remedy = "give the --out folder of suave-des campaign, or a folder with the exemplar's CSV files"
    raise InputError("has no result files" if folder.exists() else "no such folder", file=folder, remedy=remedy)


def _is_foreign(path: Path) -> bool:
    """Whether a file has none of the columns that name a manager."""
    try:
        return not {"manager", "mission name", "mission_name"} & set(_header(path))
    except (OSError, ValueError):
        return False


def _runs_sharing_draw(folder: Path) -> int:
    """Return how many runs in a row share the draws of perturbations, from a campaign's manifest; 1 if none do."""
    try:
        manifest = json.loads((folder / _MANIFEST_FILE).read_text(encoding="utf-8"))
        return max(1, int(manifest["runs_per_draw"])) if manifest["perturbations"] else 1
    except (OSError, ValueError, KeyError, TypeError):
        return 1


def _unfinished(folder: Path) -> Iterator[str]:
    """Say how many missions a campaign lacks, from its manifest if it has one."""
    try:
        missions = json.loads((folder / _MANIFEST_FILE).read_text(encoding="utf-8"))["missions"]
        left_out, failed, planned = (int(missions[key]) for key in ("left_out", "failed", "planned"))
    except (OSError, ValueError, KeyError, TypeError):
        return
    if left_out:
        how = f"suave-des campaign --resume {folder} runs the rest"
        are = "is" if left_out == 1 else "are"
        yield f"{folder} is not finished: {left_out} of {planned} missions {are} missing; {how}"
    if failed:
        yield f"{folder}: {failed} of {planned} missions failed and {'is' if failed == 1 else 'are'} missing"


def _varying(frame: pandas.DataFrame, columns: Iterable[str]) -> tuple[str, ...]:
    """Return those columns that differ between missions of one manager, seed and run: what a sweep varies."""
    columns = list(columns)
    if not columns or frame["run"].isna().any():
        return ()
    counts = frame.groupby(["manager", "seed", "run"], sort=False, observed=True)[columns].nunique(dropna=False)
    return tuple(name for name in columns if (counts[name] > 1).any())


def _check_once(missions: Missions, path: Path | None) -> None:
    """Check that no mission is there twice.

    Raises:
        InputError: one is.
    """
    frame = missions.frame
    known = frame[frame["run"].notna() & (frame["seed"] != "")]
    twice = known.duplicated(["manager", "seed", "run", *missions.swept])
    if twice.any():
        row = known[twice].iloc[0]
        problem = f"run {row['run']:.0f} of {row['manager']} with seed {row['seed']} is there twice"
        raise InputError(problem, file=path, remedy="give each mission once")


def _short_names(paths: Sequence[Path]) -> list[str]:
    """Name sources by the last parts of their paths that tell them apart."""
    parts = [path.resolve().with_suffix("").parts for path in paths]
    for depth in range(1, max(map(len, parts))):
        names = ["/".join(each[-depth:]) for each in parts]
        if len(set(names)) == len(names):
            return names
    return [str(path) for path in paths]
