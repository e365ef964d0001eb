"""Draw the contents of results folders: missions, a campaign, or a sweep."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import pandas
from matplotlib.figure import Figure

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.records.mission_folder import TRAJECTORY_FILE, MissionRecord, read_mission
from suave_des.results import campaign_figures, style
from suave_des.results.mission_figures import Rules, draw_map, draw_timeline
from suave_des.results.missions import Group, Missions, grouped, missions_of, read_missions
from suave_des.results.style import key_words

ENDINGS = (".png", ".pdf", ".svg")
_UNDATED = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
AUTO, SWEEP, HEAT_MAP, MAP, TIMELINE = "auto", "sweep", "heatmap", "map", "timeline"


CAMPAIGN_KINDS: Mapping[str, Callable[[Sequence[Group]], Figure]] = {
    "distributions": campaign_figures.draw_distributions,
    "differences": campaign_figures.draw_differences,
}
"""Figures of a campaign's missions by their names."""
_OF_MEANS = "differences"
"""What has intervals of means: of runs, as points of a sweep share a run's random numbers. The others show missions;
means over the points would be what no mission did."""
KINDS = (AUTO, MAP, TIMELINE, *CAMPAIGN_KINDS, SWEEP, HEAT_MAP)
"""All figures by their names."""


def draw_folder(folder: str | Path, out: str | Path) -> None:
    """Draw the contents of a results folder, and write the picture; see draw_results."""
    draw_results([Path(folder)], Path(out))


def draw_results(
    folders: Sequence[Path],
    out: Path,
    kind: str = AUTO,
    parameters: Sequence[str] = (),
    rules_of: Callable[[MissionRecord], Rules] = lambda record: {},
) -> None:
    """Draw the contents of results folders, and write the picture.

    Args:
        folders: one of a mission (trajectory.csv), or of campaigns (runs.csv) and files like these.
        out: picture to write; its ending says which kind.
        kind: one of KINDS; "auto": of a mission its map, of a campaign the distributions, of a sweep the means.
        parameters: of a sweep: those to draw; empty: all.
        rules_of: finds the rules behind the adaptations of a mission, for its timeline.

    Raises:
        InputError: there are no results of that kind in the folders, or the picture cannot be written.
    """
    check_picture(out)
    if kind not in KINDS:
        raise InputError(f"there is no figure {shown(kind)}", place="kind", remedy=did_you_mean(kind, KINDS))
    is_mission, wants_mission = (folders[0] / TRAJECTORY_FILE).is_file(), kind in (MAP, TIMELINE)
    if is_mission and len(folders) > 1:
        raise InputError("has a mission, of which one is drawn at a time", file=folders[0], remedy="give one folder")
    if is_mission != wants_mission and (wants_mission or kind != AUTO):
        of, command = ("a mission", "run") if wants_mission else ("a campaign", "campaign")
        remedy = f"give the --out folder of suave-des {command}"
        raise InputError(f"the figure {kind} is of {of}", file=folders[0], remedy=remedy)
    with style.publication():
        if is_mission:
            record = read_mission(folders[0])
            figure: Figure = draw_timeline(record, rules_of(record)) if kind == TIMELINE else draw_map(record)
        else:
            figure = _of_missions(read_missions(folders), kind, parameters)
        write_picture(figure, out)


def check_picture(out: Path) -> None:
    """Check that a name is a picture's.

    Raises:
        InputError: it has another ending.
    """
    if out.suffix.lower() not in ENDINGS:
        problem = f"expected a picture, got {out.suffix or 'a file without an ending'}"
        raise InputError(problem, file=out, remedy=f"one of {', '.join(ENDINGS)}")


def write_picture(figure: Figure, out: Path, *, bbox_inches: str | None = None) -> None:
    """Write a figure atomically, and without the time of writing.

    Args:
        figure: to write.
        out: .png, .pdf or .svg.
        bbox_inches: "tight" trims it to what is drawn; None: it has the figure's own size.

    Raises:
        InputError: it cannot be written.
    """
    temporary = out.with_name(f".{os.getpid()}{out.suffix}")
    try:
        figure.savefig(temporary, bbox_inches=bbox_inches, metadata=_UNDATED.get(out.suffix.lower()))
        temporary.replace(out)
    except OSError as error:
        remedy = "give a path in a folder that is yours"
        raise InputError(f"cannot be written: {error.strerror}", file=out, remedy=remedy) from None
    finally:
        with suppress(OSError):  # there may not even be a folder
            temporary.unlink()


def draw_mission(record: MissionRecord, kind: str = MAP) -> Figure:
    """Draw a mission.

    Args:
        record: of the mission.
        kind: MAP or TIMELINE.

    Raises:
        InputError: there is no such figure of a mission.
    """
    if kind not in (MAP, TIMELINE):
        remedy = did_you_mean(kind, (MAP, TIMELINE))
        raise InputError(f"there is no figure {shown(kind)} of a mission", place="kind", remedy=remedy)
    with style.publication():
        return draw_timeline(record) if kind == TIMELINE else draw_map(record)


def draw_frame(frame: pandas.DataFrame, kind: str = AUTO) -> Figure:
    """Draw the missions of a data frame with the columns of runs.csv.

    Raises:
        InputError: there is no such figure of a campaign, or the frame lacks what it needs.
    """
    with style.publication():
        return _of_missions(missions_of(frame), kind, ())


def _of_missions(missions: Missions, kind: str, parameters: Sequence[str]) -> Figure:
    if kind in (SWEEP, HEAT_MAP) or (kind == AUTO and missions.swept):
        if not missions.swept:
            raise InputError("nothing is swept in these results", place="kind", remedy="give a campaign with a sweep")
        draw = campaign_figures.draw_heat_map if kind == HEAT_MAP else campaign_figures.draw_sweep
        return draw(missions, parameters)
    if parameters:
        raise InputError("parameters are those of a sweep", place="parameters", remedy="leave them out")
    name = "distributions" if kind == AUTO else kind
    if name not in CAMPAIGN_KINDS:
        raise InputError(f"the figure {name} is of a mission", place="kind", remedy=did_you_mean(name, CAMPAIGN_KINDS))
    groups = grouped(missions, averages=name == _OF_MEANS)[0]
    figure = CAMPAIGN_KINDS[name](groups)
    if missions.swept:
        shown_are = "missions at" if all(group.is_of_missions for group in groups) else "means of each run over"
        swept = ", ".join(key_words(parameter) for parameter in missions.swept)
        campaign_figures.write_below(figure, f"{shown_are} all points of the sweep: {swept}")
    return figure
