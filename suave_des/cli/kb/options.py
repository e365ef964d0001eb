"""Share options among the `kb` commands."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from suave_des.cli.console import output
from suave_des.cli.options import KnowledgeFiles, ReasonerOption, option
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.tables import Table

if TYPE_CHECKING:
    from suave_des.kb.knowledge_base import KnowledgeBase
    from suave_des.kb.states import ManagingSettings
    from suave_des.knowledge.ontology import Ontology
    from suave_des.knowledge.state import KnowledgeState
    from suave_des.scenario.loader import LoadedScenario


TimeLimitS = Annotated[
    float,
    option("Time limit for each state, in s of CPU time.", "S", min=0.01),
]
MaxFailed = Annotated[
    int,
    option("States with up to N components failed or recovered.", "N", min=0),
]


@dataclasses.dataclass(frozen=True)
class KnowledgeOptions(KnowledgeFiles):
    """Options that name a scenario, ontologies and rules."""

    scenario: Annotated[
        str,
        option("Scenario with the knowledge base.", "SCENARIO"),
    ] = DEFAULT_SCENARIO

    def loaded(self) -> LoadedScenario:
        """Load the scenario, with the ontologies, rules and values that are given."""
        from suave_des.scenario.loader import load_scenario

        return load_scenario(self.scenario, **self.replacements)


@dataclasses.dataclass(frozen=True)
class ReasonerOptions(KnowledgeOptions):
    """Options that name ontologies, rules and a reasoner to ask."""

    reasoner: ReasonerOption = None
    time_limit: TimeLimitS = 60.0

    def knowledge(self) -> KnowledgeBase:
        """Load the knowledge base and start the reasoner."""
        from suave_des.kb.knowledge_base import KnowledgeBase

        return KnowledgeBase.load(
            **dict[str, Any](self.replacements),
            scenario=self.scenario,
            reasoner=self.reasoner,
            time_limit_s=self.time_limit,
        )

    def with_file(self, file: Path) -> ReasonerOptions:
        """Add an ontology, or a .swrl file of rules."""
        if file.suffix == ".swrl":
            return dataclasses.replace(self, rules=[*(self.rules or ()), file])
        return dataclasses.replace(self, ontology=[*(self.ontology or ()), file])


At = Annotated[
    list[str] | None,
    option(
        "Part of the state: NAME=VALUE, a FUNCTION with an objective, a YAML file, or FOLDER@SECONDS of a "
        "mission; repeatable.",
        "WHAT",
    ),
]


def state_at(
    at: Iterable[str] | None, base: Ontology, settings: ManagingSettings
) -> KnowledgeState:
    """Build the state that the words of --at describe; later ones replace earlier ones."""
    from suave_des.kb.states import StateBuilder

    builder = StateBuilder(base, settings)
    builder.add_words(at or ())
    return builder.state()


def shown(table: Table) -> str:
    """Write a table, under its title, no wider than a terminal if there is one."""
    console = output()
    width = console.width if console.is_terminal or "COLUMNS" in os.environ else None
    return f"{table.title}\n{table.text(width)}\n" if table.title else table.text(width)
