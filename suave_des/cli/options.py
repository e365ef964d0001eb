"""Arguments and options that several commands share, and how commands are grouped under headings."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, get_type_hints

import typer
from typer.core import TyperGroup

from suave_des.errors import InputError, did_you_mean, shown

if TYPE_CHECKING:
    from suave_des.scenario.loader import Replacements

Scenario = Annotated[str, typer.Argument(metavar="SCENARIO", help="A scenario file, or the name of a shipped one.")]
Ontologies = Annotated[
    list[Path] | None,
    typer.Option(
        "--ontology", metavar="FILE", help="Ontology to use instead of the scenario's; repeat it for several files."
    ),
]
Results = Annotated[
    list[Path],
    typer.Argument(
        metavar="DIR...", help="Folders of campaign or reproduce, the exemplar's CSV files, or folders of these."
    ),
]
Modes = Annotated[
    Path | None, typer.Option("--modes", metavar="FILE", help="System Modes file to use instead of the scenario's.")
]
Reasoner = Annotated[
    str | None, typer.Option("--reasoner", metavar="NAME", help="cached, pellet, or owlready2 (slow).")
]
RuleFiles = Annotated[
    list[Path] | None,
    typer.Option("--rules", metavar="FILE", help="Rule file to add to the ontologies; repeat it for several files."),
]
DisabledRules = Annotated[
    list[str] | None,
    typer.Option("--disable-rule", metavar="NAME", help="Disable a rule; repeat it for several."),
]
SetValues = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Override a scenario value, such as mission.time_limit_s=400; repeatable."
    ),
]
Seed = Annotated[int, typer.Option("--seed", help="Random seed.")]
SeedIfNew = Annotated[int | None, typer.Option("--seed", help="Random seed.", show_default="1")]
"""For commands that may go on from results, which have a seed already."""
Workers = Annotated[int, typer.Option("--workers", help="Worker processes; results do not depend on the number.")]
CampaignWorkers = Annotated[
    int | None,
    typer.Option(
        "--workers",
        help="Worker processes; results do not depend on the number.",
        show_default="2, or 1 for few missions",
    ),
]
TimeOut = Annotated[
    float | None,
    typer.Option(
        "--time-out",
        metavar="SECONDS",
        help="Wall-clock limit for a mission.",
        show_default="120; with the reasoner owlready2 1800",
    ),
]
ManagersInData = Annotated[
    str | None, typer.Option("--managers", metavar="NAME,...", help="Managers to compare; by default all in the data.")
]
Quiet = Annotated[bool, typer.Option("--quiet", help="Show no progress, and no warnings about rules and ontologies.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace results of the same kind in the output folder.")]


@dataclass(frozen=True)
class OptionGroup:
    """Options that several commands share, or that go together; a field is named as its option."""

    @property
    def given(self) -> dict[str, object]:
        """The options that are given, by name."""
        values = {f"--{each.name.replace('_', '-')}": getattr(self, each.name) for each in fields(self)}
        return {option: value for option, value in values.items() if _is_given(value)}


@dataclass(frozen=True)
class KnowledgeFiles(OptionGroup):
    """Options that replace or add to a scenario's ontologies, rules and values."""

    ontology: Ontologies = None
    rules: RuleFiles = None
    disable_rule: DisabledRules = None
    set: SetValues = None

    @property
    def replacements(self) -> Replacements:
        """What is given, as the loader takes it."""
        changed: Replacements = {"values": self.values} if self.values else {}
        return {
            "ontologies": self.ontology or (),
            "rules": self.rules or (),
            "disabled_rules": self.disable_rule or (),
            **changed,
        }

    @property
    def values(self) -> dict[str, Any]:
        """New values of the scenario, by key path."""
        return dict(key_and_value(word, "--set") for word in self.set or ())


@dataclass(frozen=True)
class Files(KnowledgeFiles):
    """Options that replace or add to all of a scenario's files and values."""

    modes: Modes = None
    reasoner: Reasoner = None

    @property
    def replacements(self) -> Replacements:
        """What is given, as the loader takes it."""
        return super().replacements | {"modes_file": self.modes, "reasoner": self.reasoner}

    def with_options(self, words: Sequence[str] | None, managers: Sequence[str]) -> Replacements:
        """What is given, with settings of managers as `manager_options` reads them."""
        options: Replacements = {"manager_options": manager_options(words, managers)} if words else {}
        return self.replacements | options


def _is_given(value: object) -> bool:
    return value is not None and value is not False and value != []


def check_no_use(options: Mapping[str, object], where: str, remedy: str = "leave it out") -> None:
    """Check that no option is given that has no effect in this use of the command.

    Args:
        options: values by name, such as those of `Files.given`.
        where: the use of the command, such as "with --resume".
        remedy: what to do instead.

    Raises:
        InputError: one is given.
    """
    for option, value in options.items():
        if _is_given(value):
            raise InputError(f"{option} cannot be used {where}", remedy=remedy)


def comma_separated(names: str | None) -> tuple[str, ...]:
    """Split NAME,NAME,...; empty if nothing is given."""
    return tuple(name.strip() for name in (names or "").split(",") if name.strip())


def key_and_value(word: str, option: str) -> tuple[str, Any]:
    """Split KEY=VALUE; the value is read as in a YAML file.

    Raises:
        InputError: there is no key, no value, or the value is not YAML.
    """
    from suave_des.scenario.yamlfile import read_value

    key, equals, value = word.partition("=")
    if not equals or not key.strip():
        raise InputError(f"{shown(word)} is not KEY=VALUE", place=option, remedy=f"for instance {option} key=1.5")
    return key.strip(), read_value(value, option)


ManagerOptions = Annotated[
    list[str] | None,
    typer.Option(
        "--manager-option",
        metavar="[MANAGER.]KEY=VALUE",
        help="Setting of a manager; without MANAGER, of every manager that is not built in; repeat it for several.",
    ),
]


def manager_options(words: Sequence[str] | None, managers: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Settings by manager and key.

    Args:
        words: as given, MANAGER.KEY=VALUE or KEY=VALUE.
        managers: names of the managers that missions are run with.

    Raises:
        InputError: a word has another form, or is for no manager of these.
    """
    from suave_des.registry import is_built_in

    settings: dict[str, dict[str, Any]] = {}
    own = [name for name in managers if not is_built_in(name)]
    for word in words or ():
        named = max((name for name in managers if word.startswith(f"{name}.")), key=len, default=None)
        key, value = key_and_value(word.removeprefix(f"{named}."), "--manager-option")
        if named is None and ":" in key:
            remedy = did_you_mean(key.rpartition(".")[0], managers, "its managers")
            raise InputError(f"{shown(key)} is for none of the managers", place="--manager-option", remedy=remedy)
        targets = [named] if named is not None else managers if len(managers) == 1 else own
        if not targets:
            remedy = (
                f"give the manager too, for instance {managers[0]}.{word}" if managers else "name the managers, too"
            )
            raise InputError(
                f"{shown(word)} applies only to managers that are not built in", place="--manager-option", remedy=remedy
            )
        for target in targets:
            settings.setdefault(target, {})[key] = value
    return settings


def grouped_options(command: Callable[..., None]) -> Callable[..., None]:
    """Turn each parameter of a command that is a dataclass into options, one for each field.

    Example:
        @grouped_options
        def show(scenario: Scenario, *, files: Files) -> None:
            loaded = load_scenario(scenario, **files.replacements)
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    parameters = [
        each.replace(annotation=hints[each.name], kind=inspect.Parameter.KEYWORD_ONLY)
        for each in inspect.signature(command).parameters.values()
        if each.name not in groups
    ]
    for group in groups.values():
        annotations = get_type_hints(group, include_extras=True)
        parameters += [
            inspect.Parameter(
                each.name, inspect.Parameter.KEYWORD_ONLY, default=each.default, annotation=annotations[each.name]
            )
            for each in fields(group)
        ]

    @functools.wraps(command)
    def with_groups(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{each.name: given.pop(each.name) for each in fields(group)})
        command(**given)

    vars(with_groups)["__signature__"] = inspect.Signature(parameters)
    with_groups.__annotations__ = {each.name: each.annotation for each in parameters}
    return with_groups


_arguments: list[str] = []


def remember_command_line(arguments: Sequence[str]) -> None:
    """Keep the arguments that the command was called with."""
    _arguments[:] = arguments


def command_line() -> list[str]:
    """The command line as it goes into a manifest: without where the program is installed."""
    return ["suave-des", *_arguments]


Command = Callable[..., None] | typer.Typer
Headings = Mapping[str, tuple[Command, ...]]
"""Headings of a help page, and the commands under each, named as their functions."""


class CommandsUnderHeadings(TyperGroup):
    """A command with others below it, which its help shows under headings, with the whole first line of their help."""

    headings: ClassVar[Headings] = {}

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands."""
        for heading, commands in self.headings.items():
            names = [_name(each) for each in commands]
            with formatter.section(heading):
                formatter.write_dl([(name, self.commands[name].get_short_help_str(200)) for name in names])


def add_commands(app: typer.Typer, headings: Headings) -> None:
    """Add the commands to an application."""
    for command in chain.from_iterable(headings.values()):
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=_name(command))
        else:
            app.command(_name(command))(command)


def _name(command: Command) -> str:
    return str(command.info.name) if isinstance(command, typer.Typer) else command.__name__.strip("_").replace("_", "-")
