"""suave-des run, campaign, reproduce, train and serve: missions, their result files, and
summaries.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from statistics import fmean
from textwrap import fill
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from suave_des.campaign import progress
from suave_des.cli.console import TEXT_WIDTH, errors, output, print_table, print_timeline
from suave_des.cli.options import (
    Fields,
    Files,
    Given,
    ManagerOptions,
    Overwrite,
    Quiet,
    ScenarioArgument,
    Seed,
    Trusted,
    any_scenario,
    argument,
    check_no_use,
    command_line,
    complete_managers,
    flag,
    flags,
    manager_options,
    option,
)
from suave_des.errors import InputError, number_of
from suave_des.files import FAMILIES, check_beside, write_beside
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.tables import Table, TableRow

if TYPE_CHECKING:
    from suave_des.campaign.campaign import CampaignResult
    from suave_des.metrics.result import MissionMetrics
    from suave_des.records.store import MissionFailure

_RUNS = 200
"""Of reproduce, for each manager."""
_PUBLISHED_MANAGERS = ("none", "random", "metacontrol", "bt", "rosa", "planta")
"""Those that have been written for SUAVE: `reproduce --managers all`."""
_FAILURES_SHOWN = 20
_BLOCKS = 10
"""Into which training missions are divided, for their means."""
_NEVER_S = 1e6
"""A time-out for missions whose time is the clients'."""
_ROWS_SHOWN = 40
"""Of a sweep with more, the first ones."""
_MAY_CHANGE = ("managers", "runs", "workers", "scheduler")
"""Options of a campaign that is resumed, too."""


def campaign(
    scenario: Annotated[str | None, any_scenario(False)] = None,
    *,
    options: Annotated[
        Given,
        Fields(
            ("out", *_MAY_CHANGE, "seed", "ensemble", "time_out_s", "record_knowledge", "overwrite")
        ),
    ],
    resume: Annotated[
        Path | None,
        option("Continue the campaign in this folder; --runs may add runs.", "DIR"),
    ] = None,
    yes: Trusted = False,
    form: Annotated[
        Literal["suave"] | None,
        option("Also write the exemplar's own files into DIR/suave.", None, "--format"),
    ] = None,
    manager_option: ManagerOptions = None,
    quiet: Quiet = False,
    files: Files,
) -> None:
    """Run many missions and write their results.

    A campaign file may hold all settings, with sweeps and values drawn in each run; options
    override it. Finished missions are kept; after an interruption, --resume DIR runs those that are
    missing.
    """
    if resume is None:
        check_no_use({"--yes": yes}, "without --resume")
        if scenario is None or "out" not in options:
            missing = "SCENARIO" if scenario is None else "--out DIR"
            raise InputError(f"{missing} is missing", remedy="see suave-des campaign --help")
    else:
        fixed = {name: value for name, value in options.items() if name not in _MAY_CHANGE}
        own = {"SCENARIO": scenario, "--format": form, "--manager-option": manager_option}
        check_no_use(
            {**own, **flags(fixed), **files.given},
            "with --resume: the settings of a campaign cannot be changed",
            "remove it, or start a new campaign in another folder",
        )
    from suave_des.campaign.campaign import resume_campaign, run_campaign

    with progress.shown(str(resume or scenario), quiet=quiet) as show:
        settings: Given = {"workers": None, "on_progress": show, **options}
        if resume is not None:
            result = resume_campaign(resume, confirmed=yes, **settings)
        else:
            assert scenario is not None
            settings |= {
                "suave_format": form == "suave",
                "command": command_line(),
                **files.replacements,
            }
            result = run_campaign(
                scenario, settings_of=partial(manager_options, manager_option), **settings
            )
    _tell_result(result)


def _tell_result(result: CampaignResult) -> None:
    """Print the summary of a campaign, how managers differ, and where its missions are; exit if
    some failed.
    """
    console = output()
    print_table(console, _summary(result))
    sharing = result.campaign.variation.runs_sharing_draw
    if sharing > 1:
        console.print(
            f"{sharing} runs share each draw: intervals treat draws as independent, not runs"
        )
    if len(result.summary) > _ROWS_SHOWN:
        more = f"... and {len(result.summary) - _ROWS_SHOWN + 1} rows more"
        console.print(f"{more}, all in {result.folder}/summary.csv")
    found = result.differences()
    if found:
        console.print()
        print_table(console, _differences(found, result.campaign.variation.sweep.parameters))
    if result.folder is not None:
        kept = f"{number_of(result.done, 'mission')} {'is' if result.done == 1 else 'are'}"
        console.print(f"{kept} in {result.folder}/runs.csv")
    exit_telling_failures(result)


def _summary(result: CampaignResult) -> Table:
    """The rows of summary.csv."""
    from suave_des.estimates import percent
    from suave_des.records.metrics import METRICS, PAPER_METRICS

    def figures(cells: TableRow, metric: str) -> tuple[str, str]:
        mean, low, high, std = (
            cells[f"{metric}_{figure}"] for figure in ("mean", "ci95_low", "ci95_high", "std")
        )
        half = "" if low is None or high is None else f" ± {(high - low) / 2.0:.2f}"
        return "" if mean is None else f"{mean:.2f}{half}", "" if std is None else f"{std:.2f}"

    parameters = result.campaign.variation.sweep.parameters
    rows = []
    shown = len(result.summary) if len(result.summary) <= _ROWS_SHOWN else _ROWS_SHOWN - 1
    for cells in result.summary[:shown]:
        swept = (
            f"{cells[name]:.6g}" if isinstance(cells[name], float) else str(cells[name])
            for name in parameters
        )
        found = "" if cells["found_share"] is None else percent(cells["found_share"])
        measured = [text for metric in PAPER_METRICS for text in figures(cells, metric)]
        manager = result.labels.get(cells["manager"], str(cells["manager"]))
        rows.append([*swept, manager, str(cells["n"]), found, *measured])
    title = f"{result.campaign.loaded.scenario.name}, seed {result.campaign.spec.seed}: means ± half their 95% intervals"
    means = [heading for metric in PAPER_METRICS for heading in (METRICS[metric].brief, "std")]
    headings = [*parameters, "manager", "missions", "found", *means]
    return Table(headings, rows, f"{title}, standard deviations", f"{'r' * len(parameters)}l")


def _differences(found: Sequence[TableRow], parameters: Sequence[str]) -> Table:
    """How managers differ, and in how many of the ensemble's parameter sets they do so in the same
    direction.
    """
    from suave_des.records.metrics import METRICS

    def bounds(low: float | None, high: float | None) -> str:
        return "" if low is None or high is None else f"{low:+.1f} to {high:+.1f}"

    rows: list[list[str]] = []
    for metric, group in groupby(found, itemgetter("metric")):
        rows.append([METRICS[metric].brief])
        for each in group:
            same = f"{max(each['members_above_0'], each['members_below_0'])} of {each['members']}"
            swept = [str(each[name]) for name in parameters]
            names = f"  {each['first']} - {each['second']}"
            by_chance = bounds(each["ci95_low"], each["ci95_high"])
            over_sets = bounds(each["range95_low"], each["range95_high"])
            size = f"{each['difference']:+.2f}"
            rows.append([*swept, names, size, by_chance, over_sets, same])
    columns = ("first - second", "difference", "by chance", "over the sets", "same sign")
    title = "Differences, paired by run, with 95% ranges"
    return Table([*parameters, *columns], rows, title, f"{'r' * len(parameters)}l")


def exit_telling_failures(result: CampaignResult) -> None:
    """List the missions that have no row, and exit with status 3 if there are any."""
    console = errors()
    for remark in result.remarks:
        console.print(f"suave-des: {remark}")
    if not result.failures:
        return
    alike: dict[tuple[str, str], list[MissionFailure]] = {}
    for failure in result.failures:
        alike.setdefault((failure.manager, failure.cause), []).append(failure)
    for first, *others in islice(alike.values(), _FAILURES_SHOWN):
        count = f" ({len(others) + 1} missions like this)" if others else ""
        console.print(f"suave-des: failed: {' '.join(str(first).split())}{count}")
    console.print(
        f"suave-des: {len(result.failures)} of {result.campaign.planned} missions failed, see manifest.json"
    )
    raise typer.Exit(3)


def reproduce(
    *,
    options: Annotated[
        Given,
        Fields(
            ("managers", "runs", "workers", "seed", "out", "overwrite", "time_out_s"),
            {
                "managers": "Managers, separated by commas; all: also bt, rosa and planta.",
                "runs": "Missions for each manager; the paper has 20.",
                "out": "Folder for result files; without it, none are written.",
            },
            {"managers": "the paper's", "runs": str(_RUNS)},
        ),
    ],
    quiet: Quiet = False,
    files: Files,
) -> None:
    """Run the paper's experiment and compare the results.

    Prints the table of the paper (SEAMS 2023, arXiv:2303.09220) beside the simulated results.
    """
    from suave_des.campaign.campaign import run_campaign
    from suave_des.reality.validation import PAPER_FILE, compare_with_paper
    from suave_des.records.metrics import PAPER_METRICS
    from suave_des.records.missions import PAPER_ORDER

    if "out" in options:
        check_beside(options["out"], [PAPER_FILE])
    settings: Given = {"runs": _RUNS, "workers": None, "command": command_line(), **options}
    managers = settings.pop("managers", [*PAPER_ORDER])
    managers = _PUBLISHED_MANAGERS if [*managers] == ["all"] else managers
    with progress.shown("reproduce", quiet=quiet) as show:
        result = run_campaign(
            DEFAULT_SCENARIO, managers, on_progress=show, **settings, **files.replacements
        )
    comparison = compare_with_paper(result.frame())
    console = output()
    for metric in PAPER_METRICS:
        print_table(console, comparison.table(metric))
        console.print()
    if not set(managers) <= set(PAPER_ORDER):
        print_table(console, _summary(result))
        console.print()
    for line in comparison.remarks():
        console.print(fill(line, min(console.width, TEXT_WIDTH)))
    if result.folder is None:
        console.print("\nNo files were written; --out DIR keeps each mission's figures.")
    else:
        write_beside(result.folder, {PAPER_FILE: comparison.markdown()})
        console.print(
            f"\nThe missions are in {result.folder}/runs.csv, this table in {result.folder}/{PAPER_FILE}"
        )
    exit_telling_failures(result)


def run(
    scenario: ScenarioArgument,
    *,
    options: Annotated[
        Given,
        Fields(
            ("seed", "out", "overwrite"),
            {"out": "Folder for mission.json, events.csv, trajectory.csv, knowledge.jsonl."},
        ),
    ],
    manager: Annotated[
        str,
        option("A manager's name, or module:Class.", "NAME", autocompletion=complete_managers),
    ] = "metacontrol",
    run_number: Annotated[int, option("Run number.", "K", "--run")] = 1,
    manager_option: ManagerOptions = None,
    files: Files,
) -> None:
    """Run one mission and print its timeline."""
    from suave_des.api import run_mission

    replaced = files.with_options(manager_option, [manager])
    result = run_mission(
        scenario, manager, run_number, command=command_line(), **options, **replaced
    )
    for remark in result.remarks:
        errors().print(f"suave-des: manager {manager}: {remark}")
    console = output()
    print_timeline(console, result)
    if (out := options.get("out")) is not None:
        *others, last = (name for name in FAMILIES["mission"] if (out / name).exists())
        console.print(f"\n{', '.join(others)} and {last} are in {out}")


def train(
    manager: Annotated[str, argument("The manager.", "MODULE:CLASS")],
    missions: Annotated[int, option("Number of training missions.")],
    out: Annotated[Path, option("File for the training result.", "FILE")],
    scenario: Annotated[str, option("Scenario to train on.", "SCENARIO")] = DEFAULT_SCENARIO,
    seed: Annotated[int, option("Training seed.")] = 0,
    overwrite: Overwrite = False,
    manager_option: ManagerOptions = None,
    *,
    files: Files,
) -> None:
    """Train a manager on missions that run in order, in one process.

    A campaign uses the resulting file with --manager-option learned=FILE, and does not change it.
    """
    from suave_des.campaign.campaign import train as trained

    found: list[MissionMetrics] = []
    options = files.with_options(manager_option, [manager])
    trained(
        scenario,
        manager,
        missions,
        out,
        seed=seed,
        overwrite=overwrite,
        on_mission=found.append,
        **options,
    )
    size = -(-missions // _BLOCKS)
    rows = []
    for first in range(0, missions, size):
        block = found[first : first + size]
        search_s = fmean(each.search_time_s for each in block)
        inspected_m = fmean(each.distance_inspected_m for each in block)
        numbers = f"{first + 1} to {first + len(block)}"
        rows.append((numbers, f"{search_s:.2f}", f"{inspected_m:.2f}"))
    headings = ("missions", "search time, s", "distance, m")
    console = output()
    print_table(console, Table(headings, rows, f"{manager} on {scenario}, means"))
    console.print(f"the training result is in {out}")


@dataclass(frozen=True)
class _Served:
    """Options of a server; a field is named as its option."""

    host: Annotated[str, option("Address.")] = "127.0.0.1"
    port: Annotated[
        int | None,
        option(
            "Port; 0 for any free one.",
            min=0,
            max=65535,
            show_default="3000; with --rosbridge 9090",
        ),
    ] = None
    host_name: Annotated[
        list[str] | None,
        option("A further name by which clients may call this machine.", "NAME"),
    ] = None
    real_time_factor: Annotated[
        float | None,
        option(
            "Mission seconds per second; 0: advance only on request.",
            "X",
            show_default="0; with --rosbridge 1",
        ),
    ] = None

    def given(self, port: int) -> Given:
        """Where to serve, as servers take it, with a default for the port."""
        names = self.host_name or ()
        given = port if self.port is None else self.port
        return {"host": self.host, "port": given, "host_names": names}


def serve(
    scenario: ScenarioArgument,
    *,
    options: Annotated[
        Given,
        Fields(
            ("runs", "out", "overwrite"),
            {
                "runs": "Missions, one after the other; with --rosbridge.",
                "out": "Folder for result files; with --rosbridge.",
            },
            {"runs": "1"},
        ),
    ],
    rosbridge: Annotated[
        bool,
        flag("--rosbridge", "Serve SUAVE's topics and services by the rosbridge protocol."),
    ] = False,
    name: Annotated[
        str | None,
        option("The client's name in results, client:NAME; with --rosbridge.", show_default="ros"),
    ] = None,
    run_number: Annotated[
        int | None,
        option("Run of the first mission.", "K", "--run", show_default="1"),
    ] = None,
    seed: Seed = 1,
    served: _Served,
    files: Files,
) -> None:
    """Serve a mission over HTTP, as UPISAS expects it of an exemplar, or as SUAVE's topics and
    services by the rosbridge protocol.
    """
    factor = served.real_time_factor
    if rosbridge:
        check_no_use({"--run": run_number}, "with --rosbridge, which flies runs 1 to --runs")
        address = {**served.given(9090), "real_time_factor": 1.0 if factor is None else factor}
        _serve_clients(
            scenario, name or "ros", address, {"seed": seed, **options, **files.replacements}
        )
        return
    check_no_use({"--name": name, **flags(options)}, "without --rosbridge")
    from suave_des.interfaces.serve import Server, Session
    from suave_des.scenario.loader import load_scenario
    from suave_des.simulation.simulator import Simulator

    simulator = Simulator(load_scenario(scenario, **files.replacements))
    session = Session(simulator, 1 if run_number is None else run_number, seed, factor or 0.0)
    with Server(session, **served.given(3000)) as server:
        print(f"http://{served.host}:{server.server_port}/monitor; Ctrl-C ends it", flush=True)
        server.serve_forever(poll_interval=0.1)


def _serve_clients(scenario: str, name: str, address: Given, options: Given) -> None:
    """Fly a campaign whose manager is a client."""
    from suave_des.campaign.campaign import fly_campaign

    try:
        from suave_des.interfaces.rosbridge import Bridge
    except ImportError as error:
        problem = f"--rosbridge needs websockets, which is not installed ({error})"
        raise InputError(problem, remedy="pip install 'suave-des[rosbridge]'") from None
    with Bridge(**address) as bridge:
        print(f"ws://{address['host']}:{bridge.port}; Ctrl-C ends it", flush=True)
        settings = {"runs": 1, "time_out_s": _NEVER_S, "command": command_line(), **options}
        result = fly_campaign(bridge.outcomes, scenario, f"client:{name}", **settings)
    _tell_result(result)
