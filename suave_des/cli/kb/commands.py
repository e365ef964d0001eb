"""The command `suave-des kb`: its commands, of which those on rules and OWL files are here.

What reads ontologies or starts Java is imported when a command runs, so that help appears at once.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import typer

from suave_des.campaign import progress
from suave_des.cli.console import counted, errors
from suave_des.cli.kb import ask, tests
from suave_des.cli.kb.options import KnowledgeOptions, MaxFailed, ReasonerOptions, TimeLimitS, shown
from suave_des.cli.options import (
    CommandsUnderHeadings,
    Headings,
    Modes,
    Quiet,
    Seed,
    Workers,
    argument,
    option,
)

if TYPE_CHECKING:
    from suave_des.kb.difference import MissionDifference
    from suave_des.knowledge.ontology import Ontology
    from suave_des.knowledge.rules import Rule

FOUND = 1
"""Exit status of `check` when there are findings that --fail-on names."""
OwlFile = Annotated[
    Path,
    argument("An OWL file; its previous version is kept as FILE.bak, FILE.bak2, ...", "FILE"),
]
RuleName = Annotated[str, argument("Name of a rule of the file.", "NAME")]
FindingsFormat = Literal["text", "json"]
FailOn = Literal["error", "warn"]


def check(
    options: KnowledgeOptions,
    modes: Modes = None,
    fail_on: Annotated[FailOn, option("Lowest level that makes the exit status 1.")] = "error",
    time_limit: TimeLimitS = 60.0,
    form: Annotated[FindingsFormat, option("Output format.", None, "--format")] = "text",
) -> None:
    """Check ontologies and rules.

    Exit status: 0 no findings at the level of --fail-on or above; 1 such findings; 2 something
    cannot be read.
    """
    from suave_des.errors import Finding, Level, has_level, ordered, summary
    from suave_des.kb.check import check as run_checks
    from suave_des.resources import shown_name
    from suave_des.scenario.loader import load_scenario
    from suave_des.scenario_knowledge import subject_of

    loaded = load_scenario(options.scenario, **(options.replacements | {"modes_file": modes}))
    findings = run_checks(replace(subject_of(loaded), time_limit_s=time_limit))
    useless = (
        Finding(Level.WARN, words, shown_name(loaded.path))
        for words in loaded.scenario.without_effect()
    )
    findings = ordered([*findings, *useless])
    if form == "json":
        print(json.dumps(list(map(asdict, findings)), indent=2, ensure_ascii=False))
    else:
        print(*map(str, findings), summary(findings), sep="\n")
    if has_level(findings, Level(fail_on.upper())):
        raise typer.Exit(FOUND)


def rules(options: KnowledgeOptions) -> None:
    """List all rules as text, in the format that --rules reads."""
    from suave_des.scenario_knowledge import open_base

    print(rules_text(open_base(options.loaded())), end="")


def rules_text(base: Ontology) -> str:
    """Write all rules of a knowledge base as one text, file by file."""
    from suave_des.knowledge.rules import naming, write_rule

    named = naming(lambda iri: not base.vocabulary.means_itself(iri))
    blocks = []
    ordered = sorted(base.rules, key=lambda rule: base.files.index(rule.file))
    for file in dict.fromkeys(rule.file for rule in ordered):
        blocks.append(f"# {file}\n")
        for rule in base.rules:
            if rule.file == file:
                text = write_rule(rule.name, rule.body, rule.head, named, enabled=rule.enabled)
                if (reason := _why_unreadable(rule, text, base)) is not None:
                    lines = "".join(f"# {line}\n" for line in text.splitlines())
                    text = f"# {reason}:\n{lines}"
                blocks.append(text)
    return "\n".join(blocks) or "# no rules\n"


def _why_unreadable(rule: Rule, text: str, base: Ontology) -> str | None:
    """Say why --rules cannot take a rule of an ontology; None: it can."""
    from suave_des.knowledge.rules import RuleError
    from suave_des.knowledge.rules.files import check_rule, looked_up
    from suave_des.knowledge.rules.parser import parse_rule

    if any(atom.expression or not atom.predicate for atom in rule.atoms):
        return "This rule has an atom without a name, which rules as text cannot have"
    try:
        read = looked_up(parse_rule(text), base.vocabulary)
        if rule.enabled:
            check_rule(read, base.vocabulary)
    except RuleError as error:
        return f"Rules as text cannot have this rule: {error.problem}"
    return None


def add_rule(
    file: OwlFile,
    rule: Annotated[str, argument('The rule, "name: body -> head", or a .swrl file.', "RULE")],
) -> None:
    """Add a rule, or those of a file, to an OWL file; nothing else changes."""
    from suave_des.kb.rule_editor import add_rules, unused_backup

    backup = unused_backup(file)
    names = [added.name for added in add_rules(file, rule)]
    are = f"rule {names[0]} is" if len(names) == 1 else f"rules {', '.join(names)} are"
    print(f"{are} in {file} now; {backup} is the previous version")


def remove_rule(file: OwlFile, name: RuleName) -> None:
    """Remove a rule from an OWL file; nothing else changes."""
    from suave_des.kb.rule_editor import remove_rule as remove
    from suave_des.kb.rule_editor import unused_backup

    backup = unused_backup(file)
    remove(file, name)
    print(f"rule {name} is not in {file} any more; {backup} is the previous version")


def enable_rule(file: OwlFile, name: RuleName) -> None:
    """Switch a rule of an OWL file on (swrla:isRuleEnabled)."""
    _switch(file, name, enabled=True)


def disable_rule(file: OwlFile, name: RuleName) -> None:
    """Switch a rule of an OWL file off (swrla:isRuleEnabled), for every reasoner."""
    _switch(file, name, enabled=False)


def _switch(file: Path, name: str, *, enabled: bool) -> None:
    from suave_des.kb.rule_editor import set_enabled, unused_backup

    backup = unused_backup(file)
    word = "enabled" if enabled else "disabled"
    if set_enabled(file, name, enabled=enabled):
        print(f"rule {name} is {word} in {file} now; {backup} is the previous version")
    else:
        print(f"rule {name} is {word} in {file} already")


def try_(
    on: Annotated[
        Path,
        option(
            "Folder of run, of a campaign that recorded its knowledge, or of such folders.", "DIR"
        ),
    ],
    rule: Annotated[
        str | None,
        argument('Rule to try, "name: body -> head", or a .swrl file.', "RULE"),
    ] = None,
    disable: Annotated[str | None, option("Evaluate without this rule.", "NAME")] = None,
    time_limit: TimeLimitS = 60.0,
) -> None:
    """Show when a rule would have fired in recorded missions, and what it would have changed.

    No mission is run again: the reasoner evaluates each recorded state with and without the rule.
    Only a new run shows the consequences of a different decision.
    """
    from suave_des.kb.replay import summary, try_rules

    print(*summary(list(try_rules(on, rule, disabled=disable, limit_s=time_limit))), sep="\n")


@dataclass(frozen=True)
class MissionOptions:
    """Options of the missions that are run with both."""

    missions: Annotated[
        int | None,
        option("Run N missions with each, and compare them in pairs.", "N", min=1),
    ] = None
    modes: Modes = None
    seed: Seed = 1
    workers: Workers = 1
    quiet: Quiet = False


def diff(
    options: ReasonerOptions,
    mission_options: MissionOptions,
    one: Annotated[
        Path,
        argument(
            "An ontology, a .swrl file of rules to add, or a decision table (.csv, or rosa,"
            " planta).",
            "A",
        ),
    ],
    other: Annotated[Path, argument("The same.", "B")],
    max_failed: MaxFailed = 2,
) -> None:
    """Compare two ontologies, sets of rules or decision tables: axioms, decisions, missions.

    --ontology, --rules and --disable-rule apply to both; an ontology given as A or B replaces the
    scenario's. Decisions are compared in every state; missions with the same number use common
    random numbers.
    """
    from suave_des.kb.decision_table import find_table, manager_of
    from suave_des.kb.difference import compare_axioms
    from suave_des.kb.table_difference import compare_deciders

    files = (one, other)
    tables = list(map(manager_of, files))
    both = [options if manager_of(file) else options.with_file(file) for file in files]
    lines = list[str]()
    with counted("states", errors()) as on_count:
        if any(tables):
            deciders = [
                find_table(file) if manager_of(file) else options.with_file(file).knowledge()
                for file in files
            ]
            base = both[tables.index(None) if None in tables else 0].knowledge()
            difference = compare_deciders(base, deciders, max_failed, on_count)
        else:
            before, after = (each.knowledge() for each in both)
            lines += _changed_axioms(*compare_axioms(before.base, after.base))
            difference = before.diff(after, max_failed, on_count)
    lines += difference.lines()
    if mission_options.missions is not None:
        missions, about = _compared_missions(both, tables, mission_options)
        lines += ["", shown(missions.table(difference)), *about]
    print(*lines, sep="\n")


def _changed_axioms(removed: Sequence[str], added: Sequence[str]) -> Iterator[str]:
    if removed or added:
        yield f"axioms and rules: {len(removed)} removed, {len(added)} added"
    yield from (f"  - {text}" for text in removed)
    yield from (f"  + {text}" for text in added)


def _compared_missions(
    both: Sequence[ReasonerOptions], tables: Sequence[str | None], options: MissionOptions
) -> tuple[MissionDifference, list[str]]:
    """Run the missions of a comparison; return what differs, and last lines about it."""
    from suave_des.kb.difference import compare_missions, firing_states
    from suave_des.knowledge.pellet import TimeLimit

    assert options.missions is not None
    one, other = (each.replacements | {"modes_file": options.modes} for each in both)
    with progress.shown("missions with A, then with B", quiet=options.quiet) as on_progress:
        missions = compare_missions(
            both[0].scenario,
            options.missions,
            one,
            other,
            managers=[name or "metacontrol" for name in tables],
            seed=options.seed,
            workers=options.workers,
            on_progress=on_progress,
        )
    if missions.changed:
        return missions, [*missions.lines()]
    if any(tables):
        return missions, ["no mission differs"]
    firing, states = firing_states(
        both[0].scenario,
        options.missions,
        one,
        other,
        seed=options.seed,
        limit=TimeLimit(both[0].time_limit, "--time-limit"),
    )
    fire = f"rules that only A or B has fire in {firing} of their {states} states"
    return missions, [f"no mission differs; {fire}"]


class _Commands(CommandsUnderHeadings):
    headings: ClassVar[Headings] = {
        "Ask": (ask.infer, ask.explain, ask.why_not, ask.policy, ask.query),
        "Check, test and compare": (check, tests.test, try_, diff),
        "Rules and OWL files": (rules, add_rule, remove_rule, enable_rule, disable_rule),
    }


app = typer.Typer(
    name="kb",
    cls=_Commands,
    add_completion=False,
    rich_markup_mode=None,
    help="Inspect the knowledge base, edit its rules, and show what they do.",
)


@app.callback(invoke_without_command=True)
def _help(context: typer.Context) -> None:
    if context.invoked_subcommand is None:
        print(context.get_help())
