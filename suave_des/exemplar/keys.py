"""The keys of the exemplar's own configuration files, and what tells its revisions apart.

The table, keys.csv, says which revisions read each key, what it is here, and its default;
the page docs/reference/exemplar-files.md shows it. Source: kas-lab/suave (Apache-2.0) at the tags
v1.2.1, v1.3.0, v1.4.0 and v1.5.0; `2023` made the published runs, `2025` is d5e97be, `HEAD` its
main branch in summer 2026. What the code of 1.2 to 1.4 does otherwise was not read: there it counts
as 1.5's, and so does that of HEAD.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import NamedTuple

from suave_des.errors import InputError, shown, unknown

RUNNER, REASONER, LAUNCH, EXPERIMENT = (
    "suave_runner_node",
    "reasoner",
    "experiment_launch",
    "experiments[]",
)
"""A campaign's node; any node with a reasoning_period; arguments NAME:=VALUE of a launch; keys of
an experiment.
"""
WATER_CURRENT = "water_current"
"""HEAD's node of the current."""
WAVE = "current.wave"
"""Key path of the current here; of the runner's parameter that says whether there is one."""
CAMPAIGN = "campaign."
"""Begins what is a key of a campaign file here, and not of a scenario."""
REVISIONS: Mapping[str, str] = {
    "2023": "seams2023",
    "1.2": "release15",
    "1.3": "release15",
    "1.4": "release15",
    "2025": "planta_exp1",
    "1.5": "release15",
}
"""Shipped scenario that an import builds on, by revision, the oldest first."""
HEAD = "HEAD"
"""Its files are read as those of the newest revision."""
_ORDER = (*REVISIONS, HEAD)
OLDEST, NEWEST = _ORDER[0], _ORDER[-2]
FIRST_WITH_RUNNER, FIRST_WITH_BRINGUP = "1.4", "1.5"


def is_since(revision: str, first: str) -> bool:
    """Whether a revision is another one or came after it."""
    return _ORDER.index(revision) >= _ORDER.index(first)


def _is_between(revision: str, first: str, last: str) -> bool:
    return is_since(revision, first) and is_since(last, revision)


class Key(NamedTuple):
    """A parameter of a node, or a key of an experiment.

    Attributes:
        path: key path of the scenario, or of the campaign file after CAMPAIGN; empty: nothing here
            corresponds to it.
        default: of the exemplar's code, None if there is none or it is not known; its type is the
            parameter's in ROS 2.
        since, until: first and last revision whose code reads it.
    """

    node: str
    name: str
    path: str
    default: object
    meaning: str
    since: str
    until: str

    def is_read_by(self, revision: str) -> bool:
        """Whether the code of a revision reads it."""
        return _is_between(revision, self.since, self.until)


_TABLE, _REVISIONS_TABLE = (
    [*csv.DictReader(Path(__file__).with_name(name).read_text(encoding="utf-8").splitlines())]
    for name in ("keys.csv", "revisions.csv")
)
KEYS = tuple(Key(**{**row, "default": json.loads(row["default"] or "null")}) for row in _TABLE)
"""The table; the runner gives its parameters to each mission, and draws from its intervals in this
order.
"""
PATHS = {(key.node, key.name): key.path for key in reversed(KEYS)}
"""Key path here of each parameter of a node; empty: nothing here corresponds to it."""
PERTURBED = f"{CAMPAIGN}perturbations."
DRAWN = tuple(key for key in KEYS if key.path.startswith(PERTURBED))
"""The runner's intervals."""
NODES = tuple(
    dict.fromkeys(key.node for key in KEYS if key.node not in (REASONER, LAUNCH, EXPERIMENT))
)
_ALIASES = {"parent_mission_node": "mission_node", "random_reasoner_node": "task_bridge"}
"""Other names of nodes; the second is that of 2023."""
_EVERY_NODE = ("**", "*")

_TELLING = {row["name"]: (row["since"], row["until"]) for row in _REVISIONS_TABLE}
"""First and last revision with a node, a parameter, or the package of a launch."""


def revision_of(found: Collection[str], name: str | None) -> tuple[str, str]:
    """Tell which revision files with these nodes, node.parameters and launched packages are of, and
    why.

    Raises:
        InputError: there is none of that name, or the files fit several, or none.
    """
    if name is not None:
        if name not in REVISIONS:
            problem = f"there is no revision {shown(name)} of the exemplar"
            raise unknown(problem, name, REVISIONS, place="--revision")
        return name, "as requested"
    fitting = list(REVISIONS)
    telling = ""
    given = list(filter(found.__contains__, _TELLING))
    for each in given:
        before = fitting
        fitting = [revision for revision in before if _is_between(revision, *_TELLING[each])]
        if fitting != before:
            telling = each
    if len(fitting) == 1:
        return fitting[0], f"only revision {fitting[0]} has {telling}"
    if not fitting:
        problem = f"no revision of the exemplar has all of {', '.join(given)}"
        raise InputError(problem, remedy="say which it is: --revision")
    problem = (
        f"the files fit revisions {', '.join(fitting)} of the exemplar, which differ in their code"
    )
    raise InputError(problem, remedy=f"say which it is, as in --revision {fitting[-1]}")


def read_by(revision: str) -> tuple[Key, ...]:
    """Return the keys that the code of a revision reads, and that a scenario has."""
    return tuple(
        key
        for key in KEYS
        if key.path and not key.path.startswith(CAMPAIGN) and key.is_read_by(revision)
    )


def is_read(node: str, name: str, revision: str) -> bool:
    """Whether a parameter is read from files of a revision; HEAD's count as the newest one's."""
    same = [key for key in KEYS if (key.node, key.name) == (node, name)]
    revisions = (NEWEST, HEAD) if revision == NEWEST else (revision,)
    return any(key.is_read_by(each) for key in same for each in revisions)


def is_every_node(entry: str) -> bool:
    """Whether an entry of a file gives its parameters to every node, as `/**` does."""
    return entry.removeprefix("/") in _EVERY_NODE


def node_of(entry: str, given: Collection[str]) -> str:
    """Return the node of the table that an entry of a file with these parameters is; or nothing."""
    bare = entry.removeprefix("/")
    if _ALIASES.get(bare, bare) in NODES:
        return _ALIASES.get(bare, bare)
    return REASONER if "reasoning_period" in given else ""


def nodes_with(name: str) -> tuple[str, ...]:
    """Return the nodes that have a parameter of a name."""
    named = (key.node for key in KEYS if key.name == name and key.node not in (LAUNCH, EXPERIMENT))
    return tuple(dict.fromkeys(named))
