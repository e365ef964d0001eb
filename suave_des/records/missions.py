"""Missions of several sources: read from folders, files or a data frame."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import Final

import pandas

from suave_des.errors import InputError, shown, unknown
from suave_des.files import read_csv, real
from suave_des.records.contents import Manifest, MissionCounts
from suave_des.records.metrics import DISTANCE, SEARCH_TIME, metric_of
from suave_des.records.runs import (
    CSV_LIMIT_BYTES,
    FRAME_COLUMNS,
    REMEDY,
    TIME_LIMIT,
    CsvContent,
    check_one_mission,
    is_foreign,
    runs_in,
)
from suave_des.records.store import RUNS_FILE, STORE_FILE, check_store, read_manifest

Source = pandas.DataFrame | str | Path | Sequence[str | Path]
"""Missions: a data frame with the columns of runs.csv, or folders and files."""
SHARING = "runs_sharing_draw"
"""Column of missions, and attribute of a frame: how many runs in a row share their draws."""
_NO_LABELS: Final[Mapping[str, str]] = MappingProxyType({})
PAPER_ORDER = {"none": 0, "random": 1, "metacontrol": 2}


@dataclass(frozen=True)
class Missions:
    """Missions to compare, a row for each.

    Attributes:
        frame: with `source`, the columns of records.runs.FRAME_COLUMNS, further metrics, and what a
            sweep varies; with `runs_sharing_draw` where that is known.
        notes: what readers of the comparison should know about the files.
        folders: of the campaigns that can be run again, by source.
        labels: of managers that are shown under another name than their own, by that.
    """

    frame: pandas.DataFrame
    swept: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    folders: Mapping[str, Path] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)

    def named(self, shown_as: str) -> str:
        """Return the manager that is shown under a name."""
        return next((name for name, label in self.labels.items() if label == shown_as), shown_as)


def missions_in(source: Source) -> Missions:
    """Take the missions of a data frame, or read those in folders and files; see missions_of and
    read_missions.
    """
    if isinstance(source, pandas.DataFrame):
        return missions_of(source)
    return read_missions(
        [Path(source)] if isinstance(source, str | Path) else list(map(Path, source))
    )


def read_missions(paths: Sequence[Path], labels: Mapping[str, str] = _NO_LABELS) -> Missions:
    """Read the missions in folders of `suave-des campaign` or `reproduce`, or of the exemplar, or
    in single CSV files.

    Args:
        paths: folders and files.
        labels: what to show instead of the name of a manager, besides what campaign files say.

    Raises:
        InputError: one of them has no missions, is given twice, or has missions of several
            scenarios; or there is no manager of a label, or two would be shown alike.
    """
    if not paths:
        raise InputError(
            "no results are given",
            remedy="give the --out folders of suave-des campaign, or CSV files",
        )
    _check_each_once(paths)
    named = dict(zip(_short_names(paths), paths, strict=True))
    read = {name: _read_source(path) for name, path in named.items()}
    _check_labels(labels, read.values())
    sources = {name: _labelled(each, labels) for name, each in read.items()}
    frames = [each.frame.assign(source=name) for name, each in sources.items()]
    folders = {name: path for name, path in named.items() if (path / STORE_FILE).is_file()}
    for folder in folders.values():
        check_store(folder / STORE_FILE)
    return Missions(
        pandas.concat(frames, ignore_index=True),
        tuple(dict.fromkeys(chain.from_iterable(each.swept for each in sources.values()))),
        _notes(sources.values()),
        folders,
        dict(chain.from_iterable(each.labels.items() for each in sources.values())),
    )


def _check_each_once(paths: Iterable[Path]) -> None:
    seen = set[Path]()
    for path in paths:
        if real(path) in seen:
            raise InputError("is given twice", file=path, remedy="name each folder of results once")
        seen.add(real(path))


def _check_labels(labels: Iterable[str], sources: Iterable[Missions]) -> None:
    managers = dict.fromkeys(chain.from_iterable(each.frame["manager"] for each in sources))
    for name in labels:
        if name not in managers:
            raise unknown(f"there is no mission of {shown(name)}", name, managers, "there are")


def _labelled(missions: Missions, further: Mapping[str, str]) -> Missions:
    """Show managers of one source under the names that its manifest and others say."""
    known = list(dict.fromkeys(missions.frame["manager"]))
    labels = {**missions.labels, **further}
    names = [labels.get(name, name) for name in known]
    for label in names:
        if names.count(label) > 1:
            problem = f"several managers would be shown as {shown(label)}"
            raise InputError(problem, place="labels", remedy="give each its own label")
    managers = missions.frame["manager"].map(dict(zip(known, names, strict=True)))
    return replace(missions, frame=missions.frame.assign(manager=managers), labels=labels)


def _read_source(path: Path) -> Missions:
    """Read the folder of a campaign, a folder of the exemplar's files, or a single file."""
    if (path / RUNS_FILE).exists():
        return _read_file(path / RUNS_FILE, is_of_folder=True)
    if path.is_dir():
        return _read_exemplars(path)
    return _read_file(path)


def _read_file(file: Path, *, is_of_folder: bool = False) -> Missions:
    """Read a file; `is_of_folder`: it stands for its folder, a campaign's."""
    folder = file.parent
    manifest = read_manifest(folder) if (folder / RUNS_FILE).exists() else Manifest()
    read = _checked(file, read_csv(file, CSV_LIMIT_BYTES, REMEDY), manifest)
    is_ours = _is_simulated(read.frame)
    frame = read.frame if is_ours else in_papers_order(read.frame)
    notes = read.notes
    if is_of_folder or (file.name == RUNS_FILE and manifest.missions is not None):
        sharing = manifest.runs_per_draw if manifest.perturbations else 1
        frame = frame.assign(**{SHARING: sharing})
        notes += tuple(_unfinished(folder, manifest.missions))
    elif is_ours:
        frame = frame.assign(**{SHARING: _sharing_seen(frame, read.swept)})
    return Missions(frame, read.swept, notes, labels=manifest.labels)


def _read_exemplars(folder: Path) -> Missions:
    """Read a folder of the exemplar's files; those that are no results, such as its statistics, are
    left out.
    """
    files = _csv_files(folder)
    contents = {file: read_csv(file, CSV_LIMIT_BYTES, REMEDY) for file in files}
    own = [file for file in files if not is_foreign(contents[file])] or files[:1]
    read = [_checked(file, contents[file], Manifest()) for file in own]
    frame = pandas.concat([each.frame for each in read], ignore_index=True)
    check_one_mission(frame, str(folder))
    frame = in_papers_order(frame)
    if _is_simulated(read[-1].frame):
        frame = frame.assign(**{SHARING: _sharing_seen(frame, ())})
    others = sorted({*files} - {*own})
    notes = [f"{file} is left out: it has no columns of missions" for file in others]
    return Missions(frame, (), (*notes, *_notes(read)))


def _csv_files(folder: Path) -> list[Path]:
    if (folder / STORE_FILE).is_file():
        remedy = f"suave-des campaign --resume {folder} runs the rest and writes them"
        raise InputError(
            "the campaign ended before its result files were written", file=folder, remedy=remedy
        )
    files = sorted(folder.glob("*.csv"))
    if not files:
        remedy = (
            "give the --out folder of suave-des campaign, or a folder with the exemplar's CSV files"
        )
        raise InputError("has no result files", file=folder, remedy=remedy)
    return files


def _checked(file: Path, content: CsvContent, manifest: Manifest) -> Missions:
    """Take the missions from the content of a file."""
    runs = runs_in(file, content)
    runs.check_simulated()
    frame = runs.frame.reset_index(drop=True)
    swept = _swept(manifest, frame) if _is_simulated(frame) else ()
    _check_once(frame, swept, file)
    return Missions(frame, swept, runs.notes)


def _notes(sources: Iterable[Missions]) -> tuple[str, ...]:
    return tuple(chain.from_iterable(each.notes for each in sources))


def _is_simulated(frame: pandas.DataFrame) -> bool:
    return bool(frame["scenario"].iloc[0])


def _check_once(frame: pandas.DataFrame, swept: Sequence[str], file: Path | None = None) -> None:
    """Check that no mission is there twice."""
    known = frame[frame["run"].notna() & (frame["seed"] != "")]
    twice = known.duplicated(["manager", "seed", "run", *swept])
    if twice.any():
        row = known[twice].iloc[0]
        problem = f"run {row['run']:.0f} of {row['manager']} with seed {row['seed']} is there twice"
        raise InputError(problem, file=file, remedy="give each mission once")


def missions_of(frame: pandas.DataFrame) -> Missions:
    """Take the missions of a data frame with the columns of runs.csv, as run_campaign returns it or
    pandas reads it.

    Raises:
        InputError: it has no missions, lacks a column, or has a mission twice.
    """
    for column in ("manager", SEARCH_TIME, DISTANCE):
        if column not in frame.columns:
            raise InputError(
                f"the data frame has no column {column!r}",
                remedy="it needs the columns of runs.csv",
            )
    if frame.empty:
        raise InputError(
            "the data frame has no missions", remedy="one row for each mission is needed"
        )
    plain = _as_read(pandas.DataFrame(frame).reset_index(drop=True))
    swept = _swept(Manifest(), plain)
    _check_once(plain, swept)
    sharing = frame.attrs.get(SHARING) or _sharing_seen(plain, swept)
    return Missions(plain.assign(**{SHARING: int(sharing)}), swept)


def _as_read(frame: pandas.DataFrame) -> pandas.DataFrame:
    """Give a frame the columns and types that one has which was read from a file."""
    texts = ("scenario", "manager", "seed")
    missing = {
        name: "" if name in texts else math.nan for name in FRAME_COLUMNS if name not in frame
    }
    frame = frame.assign(**missing, source="")
    frame = frame.astype(dict.fromkeys(texts, str))
    metrics = [str(name) for name in frame if metric_of(str(name)) is not None]
    numbers = {*metrics, "run"} - {*texts}
    try:
        return frame.astype(dict.fromkeys(numbers, "Float64")).astype(dict.fromkeys(numbers, float))
    except (ValueError, TypeError) as error:
        problem = f"the data frame's columns of metrics have something that is no number: {error}"
        raise InputError(problem, remedy="it needs the columns of runs.csv") from None


def in_papers_order(frame: pandas.DataFrame) -> pandas.DataFrame:
    """Sort real missions by manager as in the paper's table, others after these in their own
    order.
    """
    ranks = frame["manager"].map(PAPER_ORDER).fillna(len(PAPER_ORDER))
    return frame.iloc[ranks.argsort(kind="stable")].reset_index(drop=True)


def _sharing_seen(frame: pandas.DataFrame, swept: Sequence[str]) -> int:
    """Return how many runs in a row share their draws, as the columns of drawn values show it: they
    change only from one draw to the next. It is 1 if none do, or nothing shows it.
    """
    drawn = [name for name in _no_metrics(frame) if "." in name and name not in swept]
    runs = frame.dropna(subset=["run"]).drop_duplicates(["seed", "run"])
    runs = runs.sort_values(["seed", "run"], kind="stable")
    if not drawn or len(runs) < 2:
        return 1
    follows = (runs["seed"] == runs["seed"].shift()) & (runs["run"] == runs["run"].shift() + 1)
    values = runs[drawn].astype(str)
    changes = runs.loc[follows & (values != values.shift()).any(axis=1), "run"]
    return math.gcd(*(int(run) - 1 for run in changes)) or 1


def _no_metrics(frame: pandas.DataFrame) -> list[str]:
    return [name for name in map(str, frame) if metric_of(name) is None]


def _unfinished(folder: Path, missions: MissionCounts | None) -> Iterator[str]:
    """Say how many missions a campaign lacks."""
    if missions is not None and (missions.left_out or missions.failed):
        yield (
            f"{folder}: of {missions.planned} missions {missions.left_out} are missing and"
            f" {missions.failed} failed; suave-des campaign --resume {folder} runs those that are"
            " missing"
        )


def _swept(manifest: Manifest, frame: pandas.DataFrame) -> tuple[str, ...]:
    """Return the columns that a sweep varies: those that the manifest names, or else those that
    seem to vary.

    These differ between missions of one manager, seed and run, and are no metrics.
    """
    columns = [name for name in _no_metrics(frame) if name not in (*FRAME_COLUMNS, TIME_LIMIT)]
    if manifest.missions is not None:
        return tuple(name for name in manifest.sweep.names if name in columns)
    if not columns or frame["run"].isna().any():
        return ()
    counts = frame.groupby(["manager", "seed", "run"], sort=False, observed=True)[columns].nunique(
        dropna=False
    )
    return tuple(name for name in columns if (counts[name] > 1).any())


def _short_names(paths: Sequence[Path]) -> list[str]:
    """Name sources by the last parts of their paths that tell them apart."""
    parts = [real(path).with_suffix("").parts for path in paths]
    for depth in range(1, max(map(len, parts))):
        names = ["/".join(each[-depth:]) for each in parts]
        if len(set(names)) == len(names):
            return names
    return [str(path) for path in paths]
