"""What ROSA and PLANTA decide on in the exemplar's mission, and how their decisions become a table.

Facts of the exemplar (kas-lab/suave 1.5.0): functions and designs, the visibility that each search
design needs, and what thrusters are reported as.
"""

from __future__ import annotations

import csv
import io
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from suave_des import FAILED, find

SEARCH, FOLLOW, MOTION = "f_generate_search_path", "f_follow_pipeline", "f_maintain_motion"
THRUSTER_NAMES = tuple(f"c_thruster_{number}" for number in range(1, 7))
RECOVERED = "RECOVERED"
NO_GROUNDING, STAYS, NONE_LEFT = "ungrounded", "stays", "none left"
"""In decision tables: no design in use yet, and what is decided but for a design."""
DESIGNS = {
    SEARCH: ("fd_spiral_high", "fd_spiral_medium", "fd_spiral_low"),
    FOLLOW: ("fd_follow_pipeline",),
    MOTION: ("fd_all_thrusters", "fd_recover_thrusters"),
}
"""By function, the best first: by performance, 1.0, 0.5, 0.25 and 1.0, 0.75."""
NEEDED_M = {"fd_spiral_high": 3.25, "fd_spiral_medium": 2.25, "fd_spiral_low": 1.25}
"""Visibility that a design needs."""
TASKS = ((MOTION, SEARCH), (MOTION, FOLLOW))
THRUSTERS = ("fine", "failed", "recovered")
"""No report; one or more FALSE; RECOVERED, and none FALSE."""
VISIBILITIES = ("fd_spiral_high", "fd_spiral_medium", "fd_spiral_low", "", None)
"""The best search design that the visibility allows; "": none; None: it is not measured."""


class State(NamedTuple):
    """A symbolic state: designs in use by function, for those that the task needs."""

    visibility: str | None
    thrusters: str
    now: dict[str, str]


Decide = Callable[[State], dict[str, str]]
"""What is decided on each function of the task: a design, "stays" or "none left"."""


def states() -> Iterator[State]:
    """Yield every symbolic state."""
    for visibility, thrusters, task in itertools.product(VISIBILITIES, THRUSTERS, TASKS):
        for now in itertools.product(*((NO_GROUNDING, *DESIGNS[name]) for name in task)):
            yield State(visibility, thrusters, dict(zip(task, now, strict=True)))


def decisions(decide: Decide) -> dict[str, dict[tuple[str | None, str, str], str]]:
    """Decide every state.

    Returns:
        By function: what is decided by visibility, thrusters and the design in use. The function's
        decisions do not depend on other functions' designs, which is checked.
    """
    found: dict[str, dict[tuple[str | None, str, str], str]] = {}
    for state in states():
        for function, then in decide(state).items():
            key = state.visibility, state.thrusters, state.now[function]
            if found.setdefault(function, {}).setdefault(key, then) != then:
                raise ValueError(f"{function} depends on another function in {state}")
    return found


def reports(thrusters: str) -> list[str]:
    """What six thrusters can report in one of THRUSTERS, up to an exchange."""
    found = {"fine": [""], "failed": [], "recovered": []}
    for count in range(1, len(THRUSTER_NAMES) + 1):
        for failed in range(count + 1):
            statuses = [FAILED] * failed + [RECOVERED] * (count - failed)
            pairs = zip(THRUSTER_NAMES, statuses, strict=False)
            text = "; ".join(f"{name}={status}" for name, status in pairs)
            found["failed" if failed else "recovered"].append(text)
    return found[thrusters]


def regions(least_m: dict[str, float]) -> dict[str | None, str]:
    """Regions of VISIBILITIES, from the least measured visibility of each search design."""
    high, medium, low = (f"{least_m[design]:g}" for design in DESIGNS[SEARCH])
    return {
        "fd_spiral_high": f">= {high}",
        "fd_spiral_medium": f"{medium} <= . < {high}",
        "fd_spiral_low": f"{low} <= . < {medium}",
        "": f"< {low}",
        None: "not measured",
    }


def table(settings: str, decide: Decide, least_m: dict[str, float]) -> str:
    """Write the table of a manager."""
    found = decisions(decide)
    words = regions(least_m)
    columns = ["water_visibility", "components"]
    columns += [f"{name}_now" for name in found] + [f"{name}_then" for name in found]
    rows = []
    for function, by_state in found.items():
        sees = function == SEARCH
        _check_independence(by_state, 1 if sees else 0)
        for (visibility, thrusters, now), then in by_state.items():
            if (sees and thrusters != THRUSTERS[0]) or (not sees and visibility != VISIBILITIES[0]):
                continue
            said = reports(thrusters) if function == MOTION else ["any"]
            if function == FOLLOW and thrusters != THRUSTERS[0]:
                continue
            nows = [now if name == function else "any" for name in found]
            thens = [then if name == function else "" for name in found]
            seen = words[visibility] if sees else ""
            rows += [[seen, each, *nows, *thens] for each in said]
    text = io.StringIO(settings)
    text.seek(0, io.SEEK_END)
    csv.writer(text, lineterminator="\n").writerows([columns, *rows])
    return text.getvalue()


def _check_independence(by_state: dict[tuple[str | None, str, str], str], place: int) -> None:
    """Check that decisions do not depend on one part of their key: 0 visibility, 1 thrusters."""
    kept: dict[tuple[str | None, ...], str] = {}
    for key, then in by_state.items():
        rest = key[:place] + key[place + 1 :]
        if kept.setdefault(rest, then) != then:
            raise ValueError(f"decisions depend on {key[place]!r}, too")


def write(name: str, text: str) -> Path:
    """Write a table where the shipped ones are."""
    path = find("seams2023", "scenarios").parent / "managers" / f"{name}.csv"
    path.write_text(text, encoding="utf-8")
    return path
