"""Campaign files: what to run, under which managers, and what varies, in one YAML file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError

from suave_des.errors import InputError, KeyPath, shown
from suave_des.resources import find
from suave_des.scenario.layers import Files, Layer, find_named
from suave_des.scenario.problems import input_error
from suave_des.scenario.quantities import Number, Strict

FORMAT = 1
"""Version of the format."""


class CampaignFile(Strict):
    """What a campaign file may contain; the command line's options go before it."""

    campaign: int
    """Version of the format: 1."""
    scenario: str
    """The scenario to start from: a file named relative to this one, or the name of a shipped one."""
    managers: tuple[str, ...] = ("none", "random", "metacontrol")
    """Managing subsystems: names, or module:Class."""
    runs: Annotated[int, Field(strict=True)] = 20
    """Missions for each manager at each point of the sweep."""
    seed: Annotated[int, Field(strict=True)] = 1
    """Seed of everything that is random."""
    time_out_s: Number = 120.0
    """Time that one mission may take, in s of the clock on the wall."""
    until_ci: str | None = None
    """METRIC:HALF_WIDTH: a manager is stopped, at each point of its own, when half the 95% interval of the metric's
    mean is less; `runs` is then how many there are at most, and 10000 if it is left out."""
    perturbations: dict[str, Any] = Field(default_factory=dict)
    """Distributions by key path of the scenario: each run draws its own value, the same under all managers and at all
    points."""
    runs_per_draw: Annotated[int, Field(strict=True)] = 1
    """How many runs in a row share the values of the perturbations."""
    sweep: dict[str, Any] = Field(default_factory=dict)
    """Lists of values by key path of the scenario, each combined with each; or a mapping with `grid` (the same), `zip`
    (lists of which the first values go together, then the second) and `sample` (a sampled design: `method`
    latin_hypercube or sobol, `points`, and `ranges` by key path), which are combined with each other."""


_USUAL = CampaignFile(campaign=FORMAT, scenario="")


@dataclass(frozen=True)
class Sheet:
    """A campaign file that was read.

    Attributes:
        content: what it says.
        scenario: path of the scenario that it names.
        inputs: SHA-256 of the file, by its name as shown to the user.
        layer: knows the lines.
    """

    content: CampaignFile
    scenario: Path
    inputs: Mapping[str, str]
    layer: Layer = field(repr=False)

    def located(self, error: InputError) -> InputError:
        """An error about a key path of this file, with its line."""
        path = self._key_path(error.place or "")
        if not path:
            return error
        return self.layer.error(error.problem, path, error.remedy)

    def _key_path(self, place: str) -> KeyPath:
        """A place such as "sweep.grid.start.x_m" as keys of this file: those below may have points in them."""
        path: list[str | int] = []
        here: Any = self.layer.data
        while place and isinstance(here, Mapping):
            key = next((key for key in here if place == key or place.startswith(f"{key}.")), None)
            if key is None:
                break
            path.append(key)
            here, place = here[key], place[len(key) + 1 :]
        return tuple(path)


def read_sheet(name: str | Path) -> Sheet | None:
    """Read a campaign file; none if the file is something else, such as a scenario.

    Raises:
        InputError: it cannot be read, is of another version, or has a value that cannot be right.
    """
    files = Files()
    layer = Layer.of(files.yaml(find(name, "scenarios")), 0)
    if "campaign" not in layer.data:
        return None
    version = layer.data["campaign"]
    if version != FORMAT or isinstance(version, bool):
        problem = f"a campaign file of version {shown(version)}, and this suave-des reads version {FORMAT}"
        raise layer.error(problem, ("campaign",), f"write campaign: {FORMAT}, and see docs/guides/sweeps.md")
    try:
        content = CampaignFile.model_validate(layer.data)
    except ValidationError as error:
        raise input_error(error, layer, CampaignFile) from None
    return Sheet(content, find_named(layer, ("scenario",), content.scenario, "scenarios"), files.inputs, layer)


def said(sheet: Sheet | None, names: Iterable[str]) -> dict[str, Any]:
    """What a campaign file says under some of its keys, or what is usual."""
    content = _USUAL if sheet is None else sheet.content
    return {name: getattr(content, name) for name in names}
