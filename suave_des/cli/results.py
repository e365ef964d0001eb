"""suave-des compare, validate, figure, replay and report: results as tables, pictures, and pages
for a browser.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import starmap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from suave_des.campaign import progress
from suave_des.cli.campaign import exit_telling_failures
from suave_des.cli.console import TEXT_WIDTH, counted, errors, output, print_table
from suave_des.cli.options import (
    Fields,
    Files,
    Given,
    Quiet,
    Results,
    Trusted,
    any_scenario,
    argument,
    check_no_use,
    comma_separated,
    command_line,
    complete_metrics,
    flag,
    managers_option,
    option,
)
from suave_des.errors import InputError
from suave_des.errors import shown as quoted
from suave_des.files import (
    VALIDATION_FILES,
    check_beside,
    check_ending,
    check_output_file,
    check_output_folder,
    make_output_folder,
    write_beside,
    write_file,
)
from suave_des.resources import DEFAULT_SCENARIO, find, shipped_folder

if TYPE_CHECKING:
    from pandas import DataFrame

    from suave_des.campaign.campaign import CampaignResult
    from suave_des.reality.validation import Validation
    from suave_des.records.mission_folder import MissionRecord
    from suave_des.records.runs import Runs
    from suave_des.results.mission import Rules
    from suave_des.tables import Written


CompareFormat = Literal["table", "csv", "json", "markdown", "latex"]
_ENDINGS = {".csv": "csv", ".json": "json", ".md": "markdown", ".tex": "latex"}
"""Forms of a comparison by the ending of a file's name."""
FigureKind = Literal["auto", "map", "timeline", "distributions", "differences", "sweep", "heatmap"]
"""As in results.figures, which is not imported for --help."""


Labels = Annotated[
    list[str] | None,
    option("Show this text instead of a manager's name; repeatable.", "NAME=TEXT"),
]


def _labels(given: Sequence[str] | None) -> dict[str, str]:
    """What is to be shown instead of the names of managers."""
    labels: dict[str, str] = {}
    for each in given or ():
        name, equals, text = each.rpartition("=")
        if not (equals and name and text.strip()):
            remedy = "such as mine:Mine='Reactive'"
            raise InputError(f"{quoted(each)} is no NAME=TEXT", place="--label", remedy=remedy)
        labels[name] = text.strip()
    return labels


def compare(
    results: Results,
    managers: Annotated[str | None, managers_option("Only these, in this order.", "all")] = None,
    against: Annotated[
        str | None,
        option("Compare all others with this one only.", "NAME", show_default="each with each"),
    ] = None,
    label: Labels = None,
    metrics: Annotated[
        str | None,
        option(
            "Columns of runs.csv.",
            "COLUMN,...",
            show_default="search time, distance, found, reaction time",
            autocompletion=complete_metrics,
        ),
    ] = None,
    by: Annotated[
        str | None,
        option("Compare values of these swept parameters, too.", "KEY,..."),
    ] = None,
    half_width: Annotated[
        list[str] | None,
        option("Estimate the runs needed for an interval this narrow; repeatable.", "METRIC:VALUE"),
    ] = None,
    unpaired: Annotated[bool, flag("--unpaired", "Treat runs as independent.")] = False,
    assisted_by: Annotated[
        Path | None,
        option("DIR... are real missions; this is a campaign under the same conditions.", "DIR"),
    ] = None,
    population: Annotated[
        Path | None,
        option("With --assisted-by: a campaign under many such conditions.", "DIR"),
    ] = None,
    as_format: Annotated[CompareFormat, option("Output format.", None, "--format")] = "table",
    out: Annotated[
        Path | None,
        option("Write .csv, .json, .md or .tex instead of printing.", "FILE"),
    ] = None,
) -> None:
    """Compare managers by their results.

    Runs that share their random numbers are compared in pairs, which takes fewer missions. A few
    real missions can be assisted by simulated ones.
    """
    from suave_des.reality.assisted import compare_assisted
    from suave_des.records.missions import read_missions
    from suave_des.results.compare import compare_groups
    from suave_des.results.groups import grouped

    if out is not None:
        check_ending(out, _ENDINGS, "a table")
        check_output_file(out, overwrite=True)
    names, columns, points = map(comma_separated, (managers, metrics, by))
    simulated = [each for each in (assisted_by, population) if each is not None]
    if len(simulated) == 1:
        remedy = "give both: suave-des campaign makes them"
        raise InputError("--assisted-by and --population are needed together", remedy=remedy)
    if simulated:
        unused = {
            "--by": by,
            "--against": against,
            "--half-width": half_width,
            "--unpaired": unpaired,
        }
        check_no_use(unused, "with --assisted-by")
    labels = _labels(label)
    missions = read_missions(results, labels)
    comparison: Written
    if simulated:
        others = [read_missions([each], labels) for each in simulated]
        comparison = compare_assisted(missions, others, names, columns)
    else:
        groups = grouped(missions, names, columns, points)
        with counted("comparing", errors()) as show:
            comparison = compare_groups(
                groups,
                against=against,
                half_widths=half_width or (),
                unpaired=unpaired,
                on_progress=show,
            )
    if out is None:
        print(comparison.written(as_format, min(output().width, TEXT_WIDTH)), end="")
    else:
        write_file(out, comparison.written(_ENDINGS[out.suffix.lower()]))
        print(f"compared in {out}")


# Validation

TARGETS_NOT_MET = 1
"""Exit status with --strict."""
_RUNS = 2000


def validate(
    scenario: Annotated[str | None, any_scenario(DEFAULT_SCENARIO)] = None,
    data: Annotated[
        list[str] | None,
        option(
            "Real missions; repeatable. By default those published for the scenario, or else the"
            " 60 of the SUAVE paper.",
            "FILE",
            show_default=False,
        ),
    ] = None,
    runs_file: Annotated[
        Path | None,
        option("Compare this runs.csv; nothing is simulated.", "FILE"),
    ] = None,
    managers: Annotated[
        str | None, managers_option("Managers to compare; by default all in the data.")
    ] = None,
    targets: Annotated[
        Path | None,
        option("Shares to compare; by default NAME.targets.yaml beside NAME.csv.", "FILE"),
    ] = None,
    *,
    options: Annotated[
        Given,
        Fields(
            ("runs", "workers", "seed", "out", "overwrite"),
            {
                "runs": "Missions for each manager; with a campaign file, under each condition.",
                "out": "Folder for tables and validation.json.",
            },
            {"runs": f"{_RUNS}, over all conditions"},
        ),
    ],
    strict: Annotated[
        bool,
        flag("--strict", f"Exit with status {TARGETS_NOT_MET} unless every target is met."),
    ] = False,
    quiet: Quiet = False,
    files: Files,
) -> None:
    """Compare simulated missions with real ones: distributions, clusters, conclusions.

    With a campaign file that sweeps the conditions of the real missions, each is compared under its
    own condition.
    """
    from suave_des.reality.missions import (
        PAPERS_RUNS,
        numbered,
        published_for,
        read_conditions,
        read_real,
        read_targets,
        runs_in_a_row,
    )
    from suave_des.reality.validation import validate as compare

    name = scenario or DEFAULT_SCENARIO
    seed = options.get("seed", 1)
    if runs_file is not None:
        check_no_use(files.given, "with --runs-file", "leave one of them out")
    conditions = read_conditions(name, **files.replacements)
    data = data or [str(published_for(name) or PAPERS_RUNS)]
    files_of_data = [find(each, "scenarios/published") for each in data]
    real = read_real(files_of_data, conditions, runs_in_a_row(name))
    chosen = real.choose(comma_separated(managers))
    shares, limits, targets_paths = read_targets(real, targets)
    result: CampaignResult | None = None
    if runs_file is not None:
        recorded = _recorded(runs_file, list(conditions.columns), chosen, options)
        simulated = recorded.frame
        made: dict[str, object] = {"runs_file": _provenance(runs_file, recorded.files[runs_file])}
    else:
        runs = options.get("runs", -(-_RUNS // max(1, len(conditions))))
        result, simulated = _simulated(name, chosen, {**options, "runs": runs}, files, quiet=quiet)
        made = {"scenario": result.campaign.loaded.scenario.name, "runs": runs}
    validation = compare(
        real.frame, numbered(simulated, conditions), chosen, shares=shares, limits=limits, seed=seed
    )
    _print_validation(validation, real)
    sources = {
        "data": list(starmap(_provenance, real.files.items())),
        "targets": list(map(_shown, targets_paths)),
        "seed": seed,
    }
    _keep_validation(validation, options.get("out"), sources | made)
    if result is not None:
        exit_telling_failures(result)
    if strict and not validation.all_met:
        raise typer.Exit(TARGETS_NOT_MET)


def _recorded(file: Path, columns: Sequence[str], managers: Sequence[str], options: Given) -> Runs:
    """Read the missions to compare, and check the folder for the tables."""
    from suave_des.records.runs import read_runs

    recorded = read_runs(file, columns)
    recorded.check_simulated()
    recorded.choose(managers)
    out = options.get("out")
    if out is not None:
        check_output_folder(out, "campaign", overwrite="overwrite" in options)
        check_beside(out, VALIDATION_FILES)
        make_output_folder(out)
    return recorded


def _simulated(
    name: str, managers: Sequence[str], options: Given, files: Files, *, quiet: bool
) -> tuple[CampaignResult, DataFrame]:
    """Run the missions to compare; exit if a manager has none."""
    from suave_des.campaign.campaign import run_campaign

    if "out" in options:
        check_beside(options["out"], VALIDATION_FILES)
    settings: Given = {"workers": None, "command": command_line(), **options}
    with progress.shown(name, quiet=quiet) as show:
        result = run_campaign(name, managers, on_progress=show, **settings, **files.replacements)
    frame = result.frame()
    if not set(result.campaign.spec.managers) <= set(frame["manager"]):
        exit_telling_failures(result)
    return result, frame


def _print_validation(validation: Validation, real: Runs) -> None:
    console = output()
    for line in [*real.notes, ""] if real.notes else ():
        console.print(line)
    word = "published" if all(map(_is_shipped, real.files)) else "real"
    for table in validation.tables(word):
        print_table(console, table)
        console.print()
    console.print("\n".join(validation.remarks(word)))


def _keep_validation(
    validation: Validation, out: Path | None, sources: Mapping[str, object]
) -> None:
    """Write the files of a validation into a folder, if there is one, and say so."""
    from suave_des import __version__

    if out is None:
        output().print("\nNo files were written; --out DIR keeps the tables.")
        return
    about = {"version": __version__, "command": command_line(), **sources}
    write_beside(out, validation.texts(about))
    output().print(f"\nTables and validation.json are in {out}")


def _provenance(path: Path, digest: str) -> dict[str, str]:
    return {"file": _shown(path), "sha256": digest}


def _shown(path: Path) -> str:
    """Name a file as it goes into a result: a shipped one without where it is installed."""
    return f"shipped/{path.name}" if _is_shipped(path) else path.as_posix()


def _is_shipped(path: Path) -> bool:
    return path.is_relative_to(shipped_folder("scenarios/published"))


# Pictures and pages


def figure(
    folders: Annotated[list[Path], argument("Result folders or CSV files.", "DIR...")],
    out: Annotated[Path, option("Picture to write: .png, .pdf or .svg.", "FILE")],
    kind: Annotated[
        FigureKind,
        option(
            "Of a mission: map, timeline; of a campaign: distributions, differences; of a sweep: sweep, heatmap."
        ),
    ] = "auto",
    parameters: Annotated[
        str | None,
        option("Swept parameters to draw.", "KEY,...", show_default="all"),
    ] = None,
    label: Labels = None,
) -> None:
    """Draw a mission's map or a campaign's results.

    By default the contents of DIR decide: the map of a mission, a campaign's distributions, or the
    means of a sweep.
    """
    from suave_des.results.figures import draw_results

    def rules_of(record: MissionRecord) -> Rules:
        from suave_des.pages.replay import adaptation_rules

        return adaptation_rules(record)

    draw_results(folders, out, kind, comma_separated(parameters), rules_of, _labels(label))
    print(f"drawn in {out}")


Open = Annotated[bool, flag("--open", "Show the page in the browser.")]


def replay(
    folders: Annotated[
        list[Path] | None,
        argument("Folder of a campaign, or one or two of run.", "[DIR]...", show_default=False),
    ] = None,
    scenario: Annotated[
        str | None, option("Run missions of this scenario instead.", "SCENARIO")
    ] = None,
    managers: Annotated[
        str | None,
        managers_option(
            "One or two managers.",
            "metacontrol; for a campaign, the last and the first",
            "--manager",
        ),
    ] = None,
    run: Annotated[int, option("Run number.", "K")] = 1,
    seed: Annotated[int | None, option("Random seed.", show_default="1")] = None,
    point: Annotated[
        int | None,
        option("Point of the campaign's sweep.", "N", show_default="0"),
    ] = None,
    out: Annotated[
        Path | None,
        option("Page to write.", "FILE", show_default="replay.html, in DIR or the current folder"),
    ] = None,
    show: Open = False,
    yes: Trusted = False,
    *,
    files: Files,
) -> None:
    """Make a page that plays a mission, or two side by side.

    It needs no network, and shows the vehicle, what its camera sees, and what its manager knew,
    inferred and decided.
    """
    from suave_des.pages.page import write_page
    from suave_des.pages.replay import missions_in, missions_run, replay_page
    from suave_des.scenario.loader import load_scenario

    folders = folders or []
    _check_one_source(folders, scenario)
    names = comma_separated(managers)
    if folders:
        check_no_use({"--seed": seed, **files.given}, "with DIR, whose missions have their own")
        page_file = _page_file(out, folders[0], "replay.html")
    else:
        check_no_use({"--point": point}, "without a campaign's folder")
        page_file = out or Path("replay.html")
        check_output_file(page_file, overwrite=True)
    if scenario is not None:
        loaded = load_scenario(scenario, **files.replacements)
        missions = missions_run(loaded, names or ("metacontrol",), run, 1 if seed is None else seed)
    else:
        missions = missions_in(folders, names, run, point or 0, confirmed=yes)
    write_page(page_file, replay_page(missions), show=show)
    print(f"{' and '.join(each.name for each in missions)}: {page_file}")


def _check_one_source(folders: Sequence[Path], scenario: str | None) -> None:
    """Check that there are missions to play, and that it is clear which."""
    if bool(folders) == (scenario is not None):
        problem = "both DIR and --scenario are given" if folders else "there is nothing to play"
        remedy = "give DIR, the --out folder of run or campaign, or --scenario NAME"
        raise InputError(problem, remedy=remedy)


def _page_file(out: Path | None, folder: Path, name: str) -> Path:
    """Return the file to write a page to: `name` among the results, if no other is given."""
    if out is None:
        check_beside(folder, [name])
        return folder / name
    check_output_file(out, overwrite=True)
    return out


def report(
    results: Results,
    paths: Annotated[
        int,
        option("Runs of each manager with path and timeline.", "N", min=0, max=100),
    ] = 12,
    out: Annotated[
        Path | None,
        option("Page to write.", "FILE", show_default="report.html, in the first DIR"),
    ] = None,
    label: Labels = None,
    show: Open = False,
) -> None:
    """Make a page about a campaign: conclusion, tables, charts.

    It is one file that needs no network.
    """
    from suave_des.pages.page import write_page
    from suave_des.pages.report import report_page

    first = results[0]
    page_file = _page_file(out, first if first.is_dir() else first.parent, "report.html")
    write_page(page_file, report_page(results, paths, _labels(label)), show=show)
    print(f"the report is {page_file}")
