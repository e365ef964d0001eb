"""Arguments and options of commands: those that several share, those of campaigns' fields, and how
commands are built.

An option of campaigns is declared once, as a documented field of `CampaignSpec`; `Fields` makes
options of them.
"""

from __future__ import annotations

import functools
import inspect
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, get_args, get_type_hints

import typer
from typer.core import TyperGroup

from suave_des.errors import MISTAKES_LOGGER, InputError, shown
from suave_des.resources import shipped_folder

if TYPE_CHECKING:
    from suave_des.scenario.loader import Replacements


def _completing(names: Callable[[], Iterable[str]]) -> Callable[[str], list[str]]:
    """What a shell is offered for the last of several names with commas between them."""

    def complete(incomplete: str) -> list[str]:
        before, comma, begun = incomplete.rpartition(",")
        return [f"{before}{comma}{name}" for name in names() if name.startswith(begun)]

    return complete


def _scenarios() -> Iterable[str]:
    return sorted(
        path.stem
        for path in shipped_folder("scenarios").glob("*.yaml")
        if "_modes" not in path.stem
    )


# Modules that take a while are imported only when a shell asks.
complete_managers = _completing(lambda: import_module("suave_des.registry").manager_names())
complete_metrics = _completing(lambda: import_module("suave_des.records.metrics").METRICS)
complete_scenarios = _completing(_scenarios)


def argument(text: str, metavar: str, **shown_as: Any) -> Any:
    """Declare an argument with its help."""
    return typer.Argument(metavar=metavar, help=text, **shown_as)


def option(text: str, metavar: str | None = None, *names: str, **shown_as: Any) -> Any:
    """Declare an option with its help, and its names, if they are not its parameter's."""
    return typer.Option(*names, metavar=metavar, help=text, **shown_as)


def flag(name: str, text: str, **shown_as: Any) -> Any:
    """Declare an option without a value."""
    return typer.Option(name, help=text, **shown_as)


ScenarioArgument = Annotated[
    str,
    argument(
        "A scenario file, or the name of a shipped one.",
        "SCENARIO",
        autocompletion=complete_scenarios,
    ),
]
Results = Annotated[
    list[Path],
    argument("Result folders, or the exemplar's CSV files.", "DIR..."),
]
Modes = Annotated[
    Path | None,
    option("System Modes file instead of the scenario's.", "FILE"),
]
ReasonerOption = Annotated[
    str | None,
    option("cached, pellet, or owlready2 (slow).", "NAME"),
]
Seed = Annotated[int, option("Random seed.")]
Workers = Annotated[int, option("Worker processes.")]


def any_scenario(default: str | Literal[False]) -> Any:
    """Declare the argument SCENARIO of commands that take campaign files, too, with its default as
    shown.
    """
    text = "A scenario or campaign file, or a shipped scenario."
    return argument(text, "SCENARIO", show_default=default, autocompletion=complete_scenarios)


def managers_option(text: str, default: str | None = None, *names: str) -> Any:
    """Declare an option that takes names of managers, with its help, its default as shown, and
    further names for it.
    """
    return typer.Option(
        "--managers",
        *names,
        metavar="NAME,...",
        help=text,
        show_default=default or True,
        autocompletion=complete_managers,
    )


def _quiet(context: typer.Context, value: bool) -> bool:
    """Log no mistakes in rules and ontologies until the command ends."""
    logger = logging.getLogger(MISTAKES_LOGGER)
    logger.disabled = value
    context.call_on_close(lambda: setattr(logger, "disabled", False))
    return value


Quiet = Annotated[bool, flag("--quiet", "Show no progress, and no warnings.", callback=_quiet)]
Trusted = Annotated[bool, flag("--yes", "Trust the code that DIR names.")]
Overwrite = Annotated[bool, flag("--overwrite", "Replace earlier results in the output folder.")]
ManagerOptions = Annotated[
    list[str] | None,
    option(
        "Setting of a manager, or of all that are not built in; repeatable.", "[MANAGER.]KEY=VALUE"
    ),
]
Given = dict[str, Any]
"""What is given of the options of `Fields`, by the name of the field."""


@dataclass(frozen=True)
class Fields:
    """Options for fields of CampaignSpec: the annotation of a command's parameter, which takes what
    is given of them.

    `help` and `default`, as shown, are of fields for which they differ here from a campaign's.
    """

    names: tuple[str, ...]
    help: Mapping[str, str] = field(default_factory=dict)
    default: Mapping[str, str] = field(default_factory=dict)

    def parameters(self) -> Iterator[inspect.Parameter]:
        """Yield an option for each field."""
        from suave_des.campaign.spec import CampaignSpec, Option
        from suave_des.scenario.schema import field_docs

        texts = field_docs(CampaignSpec)
        for name in self.names:
            declared = CampaignSpec.model_fields[name]
            options = [each for each in declared.metadata if isinstance(each, Option)]
            shown_as = (*options, Option())[0]
            kind: Any = next(each for each in _KINDS if each in _types_in(declared.annotation))
            given = typer.Option(
                _flag(name),
                metavar=shown_as.metavar,
                help=self.help.get(name, " ".join(texts[name].split())),
                show_default=self.default.get(
                    name, shown_as.default or _written(declared.default) or False
                ),
                autocompletion=complete_managers if name == "managers" else None,
            )
            if kind is bool:
                yield _keyword(name, False, Annotated[bool, given])
            else:
                yield _keyword(name, None, Annotated[kind | None, given])

    def taken(self, given: Given) -> Given:
        """Take what is given from a command's arguments; of names, there may be several, with
        commas between them.
        """
        from suave_des.campaign.spec import CampaignSpec

        values = {name: value for name in self.names if _is_given(value := given.pop(name))}
        lists = [
            name
            for name in values
            if tuple in _types_in(CampaignSpec.model_fields[name].annotation)
        ]
        return values | {name: comma_separated(values[name]) for name in lists}


_KINDS = (bool, int, float, Path, str)


def _flag(name: str) -> str:
    return f"--{name.removesuffix('_s').replace('_', '-')}"


def _types_in(annotation: object) -> set[object]:
    parts = get_args(annotation)
    return {getattr(annotation, "__origin__", annotation)}.union(*map(_types_in, parts))


def _written(default: object) -> str:
    if isinstance(default, tuple):
        return ",".join(default)
    return str(default) if _is_given(default) else ""


def flags(given: Given) -> dict[str, object]:
    """Name what is given by its options: {"--time-out": 60.0}."""
    return {_flag(name): value for name, value in given.items()}


@dataclass(frozen=True)
class KnowledgeFiles:
    """Options that replace or add to a scenario's ontologies, rules and values; a field is named as
    its option.
    """

    ontology: Annotated[
        list[Path] | None,
        option("Ontology instead of the scenario's; repeatable.", "FILE"),
    ] = None
    rules: Annotated[
        list[Path] | None,
        option("File of rules to add to the ontologies; repeatable.", "FILE"),
    ] = None
    disable_rule: Annotated[list[str] | None, option("Rule to disable; repeatable.", "NAME")] = None
    set: Annotated[
        list[str] | None,
        option("Value of the scenario, such as visibility.period_s=40; repeatable.", "KEY=VALUE"),
    ] = None

    @property
    def given(self) -> dict[str, object]:
        """The options by name, with what is given of them."""
        return {
            f"--{each.name.replace('_', '-')}": getattr(self, each.name) for each in fields(self)
        }

    @property
    def replacements(self) -> Replacements:
        """What is given, as the loader takes it."""
        changed: Replacements = {"values": self.values} if self.values else {}
        files = {
            "ontologies": self.ontology,
            "rules": self.rules,
            "disabled_rules": self.disable_rule,
        }
        return changed | {name: value or () for name, value in files.items()}  # type: ignore[return-value]

    @property
    def values(self) -> dict[str, object]:
        """New values of the scenario, by key path."""
        return dict(key_and_value(word, "--set") for word in self.set or ())


@dataclass(frozen=True)
class Files(KnowledgeFiles):
    """Options that replace or add to all of a scenario's files and values."""

    modes: Modes = None
    reasoner: ReasonerOption = None

    @property
    def replacements(self) -> Replacements:
        """What is given, as the loader takes it."""
        return super().replacements | {"modes_file": self.modes, "reasoner": self.reasoner}

    def with_options(self, words: Sequence[str] | None, managers: Sequence[str]) -> Replacements:
        """What is given, with settings of managers as `manager_options` reads them."""
        options: Replacements = {"manager_options": manager_options(words, managers)}
        return self.replacements | options


def _is_given(value: object) -> bool:
    return value is not None and value is not False and value != []


def check_no_use(options: Mapping[str, object], where: str, remedy: str = "remove it") -> None:
    """Raise an InputError if one of some options, with their values, is given where it has no
    use.
    """
    for option, value in options.items():
        if _is_given(value):
            raise InputError(f"{option} cannot be used {where}", remedy=remedy)


def comma_separated(names: str | None) -> tuple[str, ...]:
    """Split NAME,NAME,...; empty if nothing is given."""
    return tuple(name.strip() for name in (names or "").split(",") if name.strip())


def key_and_value(word: str, option: str) -> tuple[str, object]:
    """Split KEY=VALUE; the value is read as in a YAML file.

    Raises:
        InputError: there is no key, no value, or the value is not YAML.
    """
    from suave_des.scenario.yamlfile import read_value

    key, equals, value = word.partition("=")
    if not equals or not key.strip():
        raise InputError(
            f"{shown(word)} is not KEY=VALUE", place=option, remedy=f"for instance {option} key=1.5"
        )
    return key.strip(), read_value(value, option)


def manager_options(
    words: Sequence[str] | None, managers: Sequence[str]
) -> dict[str, dict[str, Any]]:
    """Read settings, given as MANAGER.KEY=VALUE or KEY=VALUE, of the managers that missions are run
    with, by key.

    Raises:
        InputError: a word has another form, or is for no manager of these.
    """
    settings: dict[str, dict[str, Any]] = {}
    for word in words or ():
        named = max((name for name in managers if word.startswith(f"{name}.")), key=len, default="")
        key, value = key_and_value(word.removeprefix(f"{named}."), "--manager-option")
        targets = [named] if named else _taking_options(key, managers)
        if not targets:
            remedy = f"write MANAGER.KEY=VALUE, with one of {', '.join(managers) or '--managers'}"
            problem = f"{shown(word)} is for none of the managers"
            raise InputError(problem, place="--manager-option", remedy=remedy)
        for target in targets:
            settings.setdefault(target, {})[key] = value
    return settings


def _taking_options(key: str, managers: Sequence[str]) -> Sequence[str]:
    """Return the managers that an option without a manager's name is for."""
    from suave_des.registry import is_built_in

    if ":" in key:  # another manager's name
        return ()
    if len(managers) == 1:
        return managers
    return [name for name in managers if not is_built_in(name)]


_arguments: list[str] = []


def remember_command_line(arguments: Sequence[str]) -> None:
    """Keep the arguments that the command was called with."""
    _arguments[:] = arguments


def command_line() -> list[str]:
    """The command line as it goes into a manifest: without where the program is installed."""
    return ["suave-des", *_arguments]


# Commands are built of functions when they are called for: what their options are read from is slow
# to import.

Command = Callable[..., None] | typer.Typer
Headings = Mapping[str, tuple[Command, ...]]
"""Headings of a help page, and the commands under each, named as their functions."""


class CommandsUnderHeadings(TyperGroup):
    """A command with others below it, which its help shows under headings, with the whole first
    line of their help.
    """

    headings: ClassVar[Headings] = {}

    def __init__(self, **settings: Any) -> None:
        commands = {name_of(each): each for each in chain.from_iterable(self.headings.values())}
        super().__init__(**(settings | {"commands": commands}))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Build the command of a name; None if there is none."""
        found: Any = self.commands.get(cmd_name)
        return None if found is None else typer.main.get_command(_application(found))

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands."""
        for heading, commands in self.headings.items():
            with formatter.section(heading):
                formatter.write_dl([(name_of(each), _summary(each)) for each in commands])


def _application(command: Command) -> typer.Typer:
    if isinstance(command, typer.Typer):
        return command
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command(name_of(command), context_settings=CONTEXT)(with_options(command))
    return app


CONTEXT = {"help_option_names": ["-h", "--help"]}


def _summary(command: Command) -> str:
    text = command.info.help if isinstance(command, typer.Typer) else command.__doc__
    return str(text).partition("\n")[0].rstrip(".")


def name_of(command: Command) -> str:
    """Return the name that a command is called by."""
    return (
        str(command.info.name)
        if isinstance(command, typer.Typer)
        else command.__name__.strip("_").replace("_", "-")
    )


def with_options(command: Callable[..., None]) -> Callable[..., None]:
    """Turn each parameter of a command that is a dataclass, or has `Fields`, into options, one for
    each field.
    """
    hints = get_type_hints(command, include_extras=True)
    parameters: list[inspect.Parameter] = []
    last: list[inspect.Parameter] = []
    groups: dict[str, Callable[[Given], object]] = {}
    for each in inspect.signature(command).parameters.values():
        hint = hints[each.name]
        if declared := [part for part in get_args(hint) if isinstance(part, Fields)]:
            parameters += declared[0].parameters()
            groups[each.name] = declared[0].taken
        elif is_dataclass(hint):
            kinds = get_type_hints(hint, include_extras=True)
            last += [_keyword(part.name, part.default, kinds[part.name]) for part in fields(hint)]
            groups[each.name] = functools.partial(_group, hint)
        else:
            parameters.append(each.replace(annotation=hint, kind=inspect.Parameter.KEYWORD_ONLY))

    @functools.wraps(command)
    def with_groups(**given: Any) -> None:
        command(**{name: take(given) for name, take in groups.items()}, **given)

    vars(with_groups)["__signature__"] = inspect.Signature([*parameters, *last])
    with_groups.__annotations__ = {each.name: each.annotation for each in (*parameters, *last)}
    return with_groups


def _keyword(name: str, default: object, annotation: object) -> inspect.Parameter:
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
    )


def _group(kind: Any, given: Given) -> object:
    return kind(**{each.name: given.pop(each.name) for each in fields(kind)})
