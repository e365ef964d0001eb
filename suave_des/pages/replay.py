"""The replay: a page that plays missions, with the reasoning behind each adaptation."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate
from typing import Any, Final

from suave_des import __version__
from suave_des.domain import FOLLOW_PIPELINE, SEA_BED_Z_M, THRUSTER_NAMES, UNGROUND_MODE
from suave_des.managed.follow import InspectionPath
from suave_des.monitor.diagnostics import FAILED
from suave_des.pages.page import page
from suave_des.pages.recorded import explain_cycles
from suave_des.records.mission_folder import MissionRecord
from suave_des.results.mission import adaptations, details, mode_spans
from suave_des.world.pipeline import sample_points

_DECIMALS: Final = 3
STYLES: Final = ("common.css", "replay.css")
SCRIPTS: Final = ("common.js", "scene_geometry.js", "scene.js", "views.js", "panel.js", "replay.js")


def replay_page(missions: Sequence[MissionRecord]) -> str:
    """Make the page that plays missions over the same pipeline side by side, all at the same mission time."""
    scenario = missions[0].settings
    battery = scenario.battery
    content = {
        "version": __version__,
        "scenario": {
            "name": scenario.name,
            "description": scenario.description,
            "revision": scenario.revision.name,
            "time_limit_s": scenario.mission.time_limit_s,
            "thresholds_m": list(scenario.reaction_metric.visibility_thresholds_m),
            "pipeline": [list(vertex) for vertex in scenario.pipeline.vertices_m],
            "sea_bed_z_m": SEA_BED_Z_M,
            "view_tangent": scenario.vehicle.camera.tangent,
            "thrusters": len(THRUSTER_NAMES),
            "station": battery and [battery.station_x_m, battery.station_y_m, battery.station_radius_m],
        },
        "missions": [mission_on_page(each) for each in missions],
    }
    title = " and ".join(dict.fromkeys(each.name for each in missions))
    return page("replay.html", f"Replay: {title}", content, STYLES, SCRIPTS)


def mission_on_page(mission: MissionRecord) -> dict[str, Any]:
    """Return a mission as the page plays it; times in s, lengths in m.

    Returns:
        metrics: its row of runs.csv; track: columns of trajectory.csv; modes: by function, times at which they took
        effect, with their names; thrusters: times of reports, with the number from 1 and whether it works; adaptations:
        their times; inspected: times at which points of the way along the pipeline were reached, with the point's
        number and the distance until then; way: that way from the point seen first, x and y; seen: time, x and y of the
        first sight, or None; cycles: see explain_cycles.
    """
    metrics, track = mission.metrics, mission.trajectory.round(_DECIMALS)
    modes = {function: [(span.begin_s, span.what) for span in spans] for function, spans in mode_spans(mission).items()}
    thrusters: list[tuple[float, int, bool]] = []
    for t_s, detail in details(mission, "component_status"):
        component, _, status = detail.partition(" ")
        number = component.rpartition("_")[2]
        if number.isdecimal():
            thrusters.append((t_s, int(number), status != FAILED))
    events = mission.events[["t_s", "source", "event", "detail"]].itertuples(index=False, name=None)
    way = _way(mission)
    x_m, y_m, seen_s = (metrics.get(name) for name in ("detection_x_m", "detection_y_m", "detection_time_s"))
    return {
        "name": mission.name,
        "metrics": metrics,
        "track": track.astype(object).where(track.notna(), None).to_dict("list"),
        "modes": modes,
        "thrusters": thrusters,
        "adaptations": sorted({each.t_s for each in adaptations(mission)}),
        "events": [(round(t_s, 2), *words) for t_s, *words in events],
        "inspected": _inspected(mission, way, modes.get(FOLLOW_PIPELINE, ())),
        "way": [] if way is None else way.points_m[:, :2].round(_DECIMALS).tolist(),
        "seen": None if seen_s is None or x_m is None or y_m is None else (seen_s, x_m, y_m),
        "cycles": explain_cycles(mission),
    }


def _way(mission: MissionRecord) -> InspectionPath | None:
    """The way along the pipeline from the point that was seen first."""
    pipeline = mission.settings.pipeline
    altitude_m = mission.settings.revision.follow.altitude_m
    points = sample_points(pipeline.vertices_m, pipeline.points_per_piece)
    for _, detail in details(mission, "pipeline_detected"):
        number = detail.rpartition(" ")[2]
        if number.isdecimal() and int(number) < len(points):
            path = InspectionPath.there_and_back(points, altitude_m)
            return InspectionPath(path.points_m[int(number) :], path.lengths_m[int(number) :])
    return None


def _inspected(
    mission: MissionRecord, way: InspectionPath | None, modes: Sequence[tuple[float, str]]
) -> list[tuple[float, int, float]]:
    """The points of the way that the vehicle reached while it followed the pipeline, each after the one before."""
    if way is None:
        return []
    follow = mission.settings.revision.follow
    mode_times = [t_s for t_s, _ in modes]
    lengths_m = list(accumulate(way.lengths_m))
    points = way.points_m[:, :2].tolist()
    track = mission.trajectory
    found: list[tuple[float, int, float]] = []
    next_point, was_following, start_m = 0, False, 0.0
    for t_s, x_m, y_m in zip(track["t_s"], track["x_m"], track["y_m"], strict=True):
        place = bisect_right(mode_times, t_s) - 1
        is_following = place >= 0 and modes[place][1] != UNGROUND_MODE
        if is_following and not was_following:
            next_point = 0 if follow.restarts_on_activation else next_point
            start_m = lengths_m[min(next_point, len(points) - 1)]
        was_following = is_following
        while is_following and next_point < len(points):
            goal_x_m, goal_y_m = points[next_point]
            if max(abs(x_m - goal_x_m), abs(y_m - goal_y_m)) > follow.acceptance_m:
                break
            found.append((round(t_s, 2), next_point, round(lengths_m[next_point] - start_m, 2)))
            next_point += 1
    return found
