"""What results were made from, and whether a resumed campaign would go on with the same."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import suave_des
from suave_des.campaign.missions import Campaign
from suave_des.errors import InputError, shown
from suave_des.records.mission_folder import versions
from suave_des.resources import shown_name

_DECIDING = {
    "managers",
    "runs",
    "seed",
    "time_out_s",
    "sweep",
    "perturbations",
    "runs_per_draw",
    "record_knowledge",
}
"""Fields of the specification that determine results as they are."""


@cache
def code_versions() -> dict[str, str]:
    """Return what must be equal on all machines of a campaign: versions, the code of suave-des
    itself, and the kind.
    """
    total = hashlib.sha256()
    folder = Path(suave_des.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        total.update(f"{path.relative_to(folder)}\n".encode() + path.read_bytes())
    return {**versions(), "suave-des code": total.hexdigest()[:12], "machine": platform.machine()}


def deciding(campaign: Campaign, inputs: Mapping[str, str]) -> dict[str, object]:
    """Return everything that determines a campaign's results, as plain data; `inputs` are those of
    check_campaign.
    """
    spec = campaign.spec
    loaded = campaign.loaded
    # The scenario's own files are compared by their content: another comment in them decides
    # nothing.
    modes = shown_name(loaded.modes_path)
    files = {
        name: digest
        for name, digest in loaded.inputs.items()
        if name == modes or not name.endswith((".yaml", ".yml"))
    }
    return {
        "versions": versions(),
        "machine": platform.machine(),
        **spec.model_dump(mode="json", include=_DECIDING),
        "ensemble": campaign.variation.ensemble and campaign.variation.ensemble.name,
        "scenario": loaded.scenario.model_dump(mode="json"),
        "files_sha256": dict(sorted({**files, **inputs}.items())),
    }


def identity(decides: Mapping[str, object]) -> str:
    """Return the identity of a campaign, which added runs do not change, to tell it from others in
    its folder.
    """
    same = {name: value for name, value in decides.items() if name != "runs"}
    return hashlib.sha256(json.dumps(same, sort_keys=True).encode()).hexdigest()


def check_same(before: Mapping[str, object], now: Mapping[str, object], folder: Path) -> None:
    """Check that everything that determines results is unchanged, except for added runs, so that a
    campaign can resume.

    Raises:
        InputError: something differs, with its name and both values.
    """
    for place, old, new in _differences(before, now, ""):
        if place == "runs" and new >= old:
            continue
        problem = (
            f"the campaign cannot be resumed: {place} was {shown(old)}, and is now {shown(new)}"
        )
        remedy = "undo that, or start a new campaign in another folder or with --overwrite"
        raise InputError(problem, file=folder, remedy=remedy)


def _differences(before: object, now: object, place: str) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in {**before, **now}:
            yield from _differences(
                before.get(key), now.get(key), f"{place}.{key}" if place else str(key)
            )
    elif (
        isinstance(before, list)
        and isinstance(now, list)
        and len(before) == len(now)
        and place != "managers"
    ):
        for index, (old, new) in enumerate(zip(before, now, strict=True)):
            yield from _differences(old, new, f"{place}[{index}]")
    elif before != now:
        yield place, before, now
