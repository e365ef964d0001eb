"""What was asked of a campaign, and everything that decides its results: what a resumed campaign must agree with."""

from __future__ import annotations

import hashlib
import inspect
import platform
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from suave_des.campaign.early_stop import parse_until_ci
from suave_des.campaign.provenance import versions
from suave_des.errors import InputError, shown
from suave_des.managing.registry import manager_class
from suave_des.scenario.loader import LoadedScenario

_LONGEST_TIME_OUT_S = 1e6


@dataclass(frozen=True)
class Request:
    """What was asked of a campaign, as given.

    Attributes:
        scenario: path of a scenario or campaign file, or name of a shipped scenario.
        managers: names, or module:Class.
        runs: missions for each manager.
        seed: of everything that is random.
        ontologies: files in place of the scenario's.
        modes_file: file in place of the scenario's.
        reasoner: in place of the scenario's.
        rules: files of rules as text, besides the scenario's.
        disabled_rules: names of rules to switch off, besides the scenario's.
        suave_format: whether the exemplar's results file is written too.
        record_knowledge: whether each mission's knowledge states are kept.
        time_out_s: time that a mission may take.
        until_ci: METRIC:HALF_WIDTH, when a manager is stopped before it had all runs; none: never.
        sweep: values by key path; see variation.vary.
        perturbations: distribution by key path.
        runs_per_draw: how many runs in a row share what is drawn.
        of_file: names of those above that the campaign file decides, or else what is usual.
        folder: where relative paths begin.
        command: the command line, for the manifest.
    """

    scenario: str
    managers: tuple[str, ...]
    runs: int
    seed: int
    ontologies: tuple[str, ...] = ()
    modes_file: str | None = None
    reasoner: str | None = None
    rules: tuple[str, ...] = ()
    disabled_rules: tuple[str, ...] = ()
    suave_format: bool = False
    record_knowledge: bool = False
    time_out_s: float = 120.0
    until_ci: str | None = None
    sweep: Mapping[str, Any] = field(default_factory=dict)
    perturbations: Mapping[str, Any] = field(default_factory=dict)
    runs_per_draw: int = 1
    of_file: tuple[str, ...] = ()
    folder: str = ""
    command: tuple[str, ...] = ()

    def plain(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> Request:
        """From plain data."""
        parts: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in plain.items()
        }
        return cls(**parts)


def check_time_out(time_out_s: float) -> None:
    """See that a time-out makes sense.

    Raises:
        InputError: it does not.
    """
    if not 0.0 < time_out_s <= _LONGEST_TIME_OUT_S:
        remedy = f"give seconds above 0, at most {_LONGEST_TIME_OUT_S:g}"
        raise InputError(f"time-out: {time_out_s:g} is out of range", remedy=remedy)


def deciding(request: Request, loaded: LoadedScenario, inputs: Mapping[str, str]) -> dict[str, Any]:
    """All that decides a campaign's results, as plain data.

    Args:
        request: what was asked.
        loaded: the scenario with its files.
        inputs: SHA-256 of each input file, by its name as shown to the user.
    """
    return {
        "versions": versions(),
        "machine": platform.machine(),
        "seed": request.seed,
        "managers": list(request.managers),
        "manager_code_sha256": {name: manager_code(name) for name in request.managers},
        "runs": request.runs,
        "time_out_s": request.time_out_s,
        "record_knowledge": request.record_knowledge,
        "until_ci": None if request.until_ci is None else asdict(parse_until_ci(request.until_ci)),
        "sweep": request.sweep,
        "perturbations": request.perturbations,
        "runs_per_draw": request.runs_per_draw,
        "scenario": loaded.scenario.model_dump(mode="json"),
        # The scenario's own files are compared by what they say: another comment in them decides nothing.
        "files_sha256": {
            Path(name).name: digest for name, digest in sorted(inputs.items()) if not _describes_scenario(name, loaded)
        },
    }


def _describes_scenario(name: str, loaded: LoadedScenario) -> bool:
    return name.endswith((".yaml", ".yml")) and Path(name).name != loaded.modes_path.name


def manager_code(name: str) -> str:
    """SHA-256 of the module that a manager is in."""
    module = sys.modules[manager_class(name).__module__]
    try:
        source = inspect.getsource(module)
    except (OSError, TypeError):  # compiled, or typed into an interpreter
        return "unknown"
    return hashlib.sha256(source.encode()).hexdigest()


def check_same(before: Mapping[str, Any], now: Mapping[str, Any], folder: Path) -> None:
    """See that a campaign may go on: what decides results is as it was, but for what only adds runs.

    Raises:
        InputError: something differs, with its name and both values.
    """
    for place, old, new in _differences(before, now, ""):
        if (place == "runs" and new >= old) or (place == "until_ci.half_width" and new <= old):
            continue
        raise InputError(
            f"the campaign cannot go on: {place} was {shown(old)}, and is {shown(new)} now",
            file=folder,
            remedy="undo that, or start anew in another folder or with --overwrite",
        )


def _differences(before: Any, now: Any, place: str) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in [*before, *(key for key in now if key not in before)]:
            yield from _differences(before.get(key), now.get(key), f"{place}.{key}" if place else str(key))
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now) and place != "managers":
        for index, (old, new) in enumerate(zip(before, now, strict=True)):
            yield from _differences(old, new, f"{place}[{index}]")
    elif before != now:
        yield place, before, now
