"""The experiments of the exemplar's runner: which mission of it each launches, under which manager."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, Field

from suave_des.errors import shown
from suave_des.scenario.exemplar_nodes import RUNNER, Configuration
from suave_des.scenario.quantities import Within, wrong

Count = Annotated[int, Field(strict=True), Within(ge=1)]
EXTENDED = "suave_extended"
"""Name of the exemplar's mission with a battery and recharging."""
_TREES = {"suave_bt": "bt", "suave_bt_extended": "bt_extended"}
"""Manager by the name of the behaviour tree's executable."""
_ARGUMENT = re.compile(r"(\w+):=(\S+)")
_LIKE_THIS = 'as in {"adaptation_manager": "metacontrol", "num_runs": 20}'


def json_object(value: Any) -> Any:
    """Return the object that a text is in JSON; for a validator."""
    content = value
    if isinstance(value, str):
        try:
            content = json.loads(value)
        except (ValueError, RecursionError):
            content = None
    if not isinstance(content, dict):
        raise wrong(f"{shown(value)} is not a JSON object", _LIKE_THIS)
    return content


class Experiment(BaseModel):
    """Missions of one manager."""

    adaptation_manager: Annotated[str, Field(min_length=1)]
    num_runs: Count
    mission_name: str = ""
    experiment_launch: str = ""

    def manager(self, *, extended: bool) -> str:
        """Return the manager's name here: that of the behaviour tree depends on its executable and on the mission.

        Args:
            extended: whether the configuration of the mission asks for the extended one.
        """
        if self.adaptation_manager != "bt":
            return self.adaptation_manager
        executable = self._arguments.get("bt_executable")
        if executable is None:
            return "bt_extended" if extended or self.is_extended else "bt"
        return _TREES.get(executable, executable)

    @property
    def is_extended(self) -> bool:
        """Whether its mission is the one with a battery."""
        names = (
            self.mission_name,
            *(self._arguments.get(key, "") for key in ("mission_name", "mission", "mission_type")),
        )
        return EXTENDED in names or self._arguments.get("bt_executable") == "suave_bt_extended"

    @property
    def _arguments(self) -> Mapping[str, str]:
        return dict(_ARGUMENT.findall(self.experiment_launch))


Experiments = tuple[Annotated[Experiment, BeforeValidator(json_object)], ...]


def is_extended(configuration: Configuration) -> bool:
    """Return whether any mission of a configuration is the extended one."""
    for parameter in configuration.parameters:
        if parameter.key == "mission_name" and parameter.value == EXTENDED:
            return True
        if parameter.kind == RUNNER and parameter.key == "experiments" and isinstance(parameter.value, list):
            for each in parameter.value:
                try:
                    if Experiment.model_validate(json_object(each)).is_extended:
                        return True
                except ValueError:  # reported where the campaign is imported
                    continue
    return False
