"""The keys of the exemplar's configuration files: which revisions read each, what it is here, and its default.

The table, keys.csv, is that of the import, of the way back, and of the page docs/reference/exemplar-files.md. Source:
kas-lab/suave (Apache-2.0) at the tags v1.2.1, v1.3.0, v1.4.0 and v1.5.0; `2023` made the published runs, `2025` is
d5e97be. What the code of 1.2 to 1.4 does otherwise was not read: there it counts as 1.5's.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from suave_des.errors import InputError, did_you_mean, shown

RUNNER, REASONER, LAUNCH, EXPERIMENT = "suave_runner_node", "reasoner", "experiment_launch", "experiments[]"
"""A campaign's node; any node with a reasoning_period; arguments NAME:=VALUE of a launch; keys of an experiment."""
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
_ORDER = tuple(REVISIONS)
OLDEST, NEWEST = _ORDER[0], _ORDER[-1]
FIRST_WITH_RUNNER, FIRST_WITH_BRINGUP = "1.4", "1.5"


def is_since(revision: str, first: str) -> bool:
    """Whether a revision is another one or came after it."""
    return _ORDER.index(revision) >= _ORDER.index(first)


class Key(NamedTuple):
    """A parameter of a node, or a key of an experiment.

    Attributes:
        node: that has it.
        name: of the parameter.
        path: key path of the scenario, or of the campaign file after CAMPAIGN; empty: nothing here corresponds to it.
        default: of the exemplar's code, None if there is none or it is not known; its type is the parameter's in ROS 2.
        meaning: for people.
        since, until: first and last revision whose code reads it.
    """

    node: str
    name: str
    path: str
    default: Any
    meaning: str
    since: str
    until: str

    def is_read_by(self, revision: str) -> bool:
        """Whether the code of a revision reads it."""
        return is_since(revision, self.since) and is_since(self.until, revision)


KEYS = tuple(
    Key(**{**row, "default": json.loads(row["default"] or "null")})
    for row in csv.DictReader(Path(__file__).with_name("keys.csv").read_text(encoding="utf-8").splitlines())
)
"""The table; the runner gives its parameters to each mission, and draws from its intervals in this order."""
PERTURBED = f"{CAMPAIGN}perturbations."
DRAWN = tuple(key for key in KEYS if key.path.startswith(PERTURBED))
"""The runner's intervals."""
NODES = tuple(dict.fromkeys(key.node for key in KEYS if key.node not in (REASONER, LAUNCH, EXPERIMENT)))
ALIASES = {"parent_mission_node": "mission_node", "random_reasoner_node": "task_bridge"}
"""Other names of nodes; the second is that of 2023."""

_TELLING: Mapping[str, tuple[str, str]] = {
    "random_reasoner_node": ("2023", "2023"),
    "task_bridge": ("1.2", "1.5"),
    "mission_metrics": ("1.3", "1.5"),
    "battery_monitor": ("1.3", "1.5"),
    RUNNER: (FIRST_WITH_RUNNER, "1.5"),
    "mission_metrics.water_visibiity_threshold": ("1.3", "2025"),
    "mission_metrics.water_visibility_threshold": ("1.5", "1.5"),
    f"{RUNNER}.random_seed": ("1.5", "1.5"),
    "suave_bringup": (FIRST_WITH_BRINGUP, "1.5"),
}
"""First and last revision with a node, a parameter, or the package of a launch."""


def revision_of(found: Collection[str], name: str | None) -> tuple[str, str]:
    """Tell which revision files are of, and why.

    Args:
        found: nodes, node.parameter and launched packages in the files.
        name: of the revision, if the user gave it.

    Raises:
        InputError: there is none of that name, or the files fit several, or none.
    """
    if name is not None:
        if name in REVISIONS:
            return name, "as requested"
        problem = f"there is no revision {shown(name)} of the exemplar"
        raise InputError(problem, place="--revision", remedy=did_you_mean(name, REVISIONS))
    fitting, telling = list(_ORDER), ""
    for each, (first, last) in _TELLING.items():
        if each in found:
            left = [revision for revision in fitting if is_since(revision, first) and is_since(last, revision)]
            telling = each if len(left) < len(fitting) else telling
            fitting = left
    if len(fitting) == 1:
        return fitting[0], f"only revision {fitting[0]} has {telling}"
    if not fitting:
        problem = f"no revision of the exemplar has all of {', '.join(each for each in _TELLING if each in found)}"
        raise InputError(problem, remedy="say which it is: --revision")
    problem = f"the files fit revisions {', '.join(fitting)} of the exemplar, which differ in their code"
    raise InputError(problem, remedy=f"say which it is, as in --revision {fitting[-1]}")


def read_by(revision: str) -> tuple[Key, ...]:
    """Return the keys that the code of a revision reads, and that a scenario has."""
    return tuple(key for key in KEYS if key.path and not key.path.startswith(CAMPAIGN) and key.is_read_by(revision))


def path_of(node: str, name: str, unknown: str = "") -> str:
    """Return the key path of a parameter here; empty if it has none."""
    return next((key.path for key in KEYS if (key.node, key.name) == (node, name)), unknown)


def read_instead(node: str, name: str, revision: str) -> tuple[str | None, str | None]:
    """Return a parameter's key path, None if it is unknown, and what a revision reads that does not read it."""
    own = [key for key in KEYS if (key.node, key.name) == (node, name)]
    if not own or not own[0].path or any(key.is_read_by(revision) for key in own):
        return (own[0].path if own else None), None
    others = [f"{key.node}.{key.name}" for key in read_by(revision) if key.path == own[0].path]
    return own[0].path, (*others, "nothing of the kind")[0]


def node_of(entry: str, given: Collection[str], name: str) -> str:
    """Return the node of the table that an entry of a file is, with these parameters, for one of them; or nothing."""
    bare = ALIASES.get(entry.removeprefix("/"), entry.removeprefix("/"))
    if bare in ("**", "*"):  # the parameter is given to every node
        return next((key.node for key in KEYS if key.name == name and key.node not in (LAUNCH, EXPERIMENT)), "")
    return bare if bare in NODES else REASONER if "reasoning_period" in given else ""
