"""What is seen of a campaign while it runs: on a terminal, in a notebook, in a log, and with --quiet."""

from __future__ import annotations

import io
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest
from rich.console import Console

from benchmarks import chaos
from suave_des.campaign import progress as display
from suave_des.campaign.campaign import CampaignInterrupted, resume_campaign, run_campaign
from suave_des.campaign.progress import GROUPS_SHOWN, OnProgress, Progress, ProgressTracker
from suave_des.records.metrics import COLUMNS
from suave_des.records.store import MissionFailure, MissionKey
from suave_des.records.store import Outcome as Finished
from tests.helpers import AWKWARD

PLACE = COLUMNS.index("search_time_s")


def outcome(point: int, manager: int, run: int, value: float | None) -> Finished:
    if value is None:
        return MissionKey(point, manager, run), MissionFailure("none", run, None, "failed")
    return MissionKey(point, manager, run), tuple(value if place == PLACE else None for place in range(len(COLUMNS)))


class TestProgressTracker:
    def test_knows_each_manager_s_mean(self) -> None:
        tracker = ProgressTracker(1, ["none", "random"], 5)
        values = [100.0, 120.0, 170.0]
        tracker.add(outcome(0, 0, run, value) for run, value in enumerate(values, 1))
        tracker.add([outcome(0, 0, 4, None)])
        progress = tracker.progress()
        assert (progress.done, progress.failed, progress.total) == (4, 1, 10)
        none, rest = progress.groups()
        assert (none.manager, none.done, none.failed, none.runs) == ("none", 4, 1, 5)
        assert none.mean_s == pytest.approx(130.0)
        assert (rest.manager, rest.done, rest.mean_s) == ("random", 0, None)

    def test_of_many_points_it_tells_and_remembers_few(self) -> None:
        tracker = ProgressTracker(1000, ["none"], 2)
        for point in range(500):
            tracker.add([outcome(point, 0, 1, 5.0), outcome(point, 0, 2, 6.0)])
        tracker.add([outcome(500, 0, 1, 7.0)])
        groups = tracker.progress().groups()
        assert [group.point for group in groups] == list(range(501 - GROUPS_SHOWN, 501))
        assert (groups[-1].done, groups[-1].mean_s, tracker.progress().total) == (1, 7.0, 2000)


def shown_on(console: Console, label: str = "seams2023", *, quiet: bool = False) -> None:
    """Show a campaign of two managers that goes on for a while."""
    tracker = ProgressTracker(1, ["none", "a_module_with_a_long_name:AndAClass"], 40)
    with display.shown(label, console, quiet=quiet) as show:
        for run in range(1, 41):
            tracker.add([outcome(0, 0, run, None if run == 7 else 180.0 + run % 3)])
            if show is not None:
                show(tracker.progress())


class TestOnATerminal:
    def last_screen(self, width: int) -> list[str]:
        text = io.StringIO()
        shown_on(Console(file=text, force_terminal=True, width=width, color_system=None))
        plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text.getvalue()).replace("\r", "\n")
        lines = [line.rstrip() for line in plain.splitlines()]
        assert all(len(line) <= width for line in lines)
        return lines[max(place for place, line in enumerate(lines) if line == "seams2023") :]

    @pytest.mark.parametrize("width", [80, 120])
    def test_it_has_all_managers_and_fits(self, width: int, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(display, "_UPDATE_PERIOD_S", 0.0)
        _, head, names, none, other, *_ = self.last_screen(width)
        assert re.search(r" 40/80 +[\d,]+/s +[\w ]+ left +1 failed$", head)
        assert names.split() == ["manager", "missions", "failed", "search", "time,", "s"]
        assert re.fullmatch(r"none +40 +1 +181\.00  done", none)
        assert re.fullmatch(r"a_module_with_a_long_name:AndAClass +0", other)

    def test_it_is_gone_at_the_end(self) -> None:
        text = io.StringIO()
        shown_on(Console(file=text, force_terminal=True, width=80))
        assert text.getvalue().rstrip().endswith("\x1b[2K")  # lines are erased, and nothing comes after

    def test_it_is_drawn_a_few_times_a_second_however_many_missions_there_are(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        seen: list[object] = []
        look = display._View.look
        monkeypatch.setattr(display._View, "look", lambda self: (seen.append(self), look(self)))
        tracker = ProgressTracker(1, ["none"], 5000)
        with display.shown("x", Console(file=io.StringIO(), force_terminal=True)) as show:
            assert show is not None
            monkeypatch.setattr(display.time, "monotonic", iter(range(10**6)).__next__)
            monkeypatch.setattr(display, "_UPDATE_PERIOD_S", 1000)
            for run in range(1, 5001):
                tracker.add([outcome(0, 0, run, 1.0)])
                show(tracker.progress())
        assert 4 <= len(seen) <= 6


class TestLines:
    def lines(self, console: Console, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(display, "_FIRST_LINE_S", 0.0)
        shown_on(console)

    def test_a_short_campaign_has_none(self) -> None:
        text = io.StringIO()
        shown_on(Console(file=text))
        assert text.getvalue() == ""

    def test_a_long_one_has_some_and_a_last_one(self, monkeypatch: pytest.MonkeyPatch) -> None:
        text = io.StringIO()
        self.lines(Console(file=text, width=40), monkeypatch)
        first, *_, last = text.getvalue().splitlines()
        assert first.startswith("suave-des: seams2023: ")
        assert re.match(r"suave-des: seams2023: 40 of 80 missions, 1 failed[,;] ", last)
        assert last.endswith("; search time, s: none 181.00")

    def test_a_terminal_that_can_only_write_lines_has_them(self, monkeypatch: pytest.MonkeyPatch) -> None:
        text = io.StringIO()
        self.lines(Console(file=text, force_terminal=True, _environ={"TERM": "dumb"}), monkeypatch)
        assert "suave-des: seams2023: 40 of 80 missions" in text.getvalue()

    def test_a_label_is_no_markup(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(display, "_FIRST_LINE_S", 0.0)
        text = io.StringIO()
        shown_on(Console(file=text), "my[bold]file.yaml")
        assert "my[bold]file.yaml" in text.getvalue()

    def test_quiet_means_nothing(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(display, "_FIRST_LINE_S", 0.0)
        for is_terminal in (False, True):
            text = io.StringIO()
            shown_on(Console(file=text, force_terminal=is_terminal), quiet=True)
            assert text.getvalue() == ""


def test_in_a_notebook_one_output_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a stand-in for the two names of IPython that are used, as they are documented."""
    outputs: list[list[str]] = []

    class Html:
        def __init__(self, text: str) -> None:
            self.text = text

    class Handle:
        def __init__(self, first: Html) -> None:
            outputs.append([first.text])

        def update(self, html: Html) -> None:
            outputs[-1].append(html.text)

    def show(html: Html, *, display_id: bool) -> Handle:
        assert display_id
        return Handle(html)

    package, module = ModuleType("IPython"), ModuleType("IPython.display")
    module.HTML, module.display = Html, show  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", package)
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    shown_on(Console(force_jupyter=True))
    (updates,) = outputs
    assert "starting" in updates[0]
    assert re.search(r"none .*40 .*181\.00", re.sub(r"<[^>]*>", "", updates[-1]))
    assert "<pre" in updates[-1]


class TestDuringACampaign:
    @pytest.mark.parametrize("workers", [1, 2])
    @pytest.mark.usefixtures("quick_workers")
    def test_the_last_that_is_told_is_what_summary_csv_says(self, workers: int, tmp_path: Path) -> None:
        seen: list[Progress] = []
        managers = ["none", f"{AWKWARD}:RaisesInHalf"]
        result = run_campaign("seams2023", managers, 12, 1, workers, tmp_path / "out", on_progress=seen.append)
        last = seen[-1]
        assert (last.done, last.failed, last.total) == (24, len(result.failures), 24)
        for group, told in zip(last.groups(), result.summary, strict=True):
            assert (group.manager, group.done - group.failed) == (told["manager"], told["n"])
            assert group.mean_s == pytest.approx(told["search_time_s_mean"])

    def test_resumed_it_goes_on_from_what_is_done(self, tmp_path: Path) -> None:
        scenario = tmp_path / "short.yaml"
        scenario.write_text(chaos.SHORT)

        def stopping(missions: int) -> OnProgress:
            def ctrl_c(progress: Progress) -> None:
                if progress.done >= missions:
                    raise KeyboardInterrupt

            return ctrl_c

        with pytest.raises(CampaignInterrupted):
            run_campaign(scenario, ["none"], 20, 1, out=tmp_path / "out", on_progress=stopping(8))
        seen: list[Progress] = []
        resume_campaign(tmp_path / "out", on_progress=seen.append)
        assert [one.done for one in seen] == [*range(9, 21)]
        assert seen[-1].groups()[0].done == 20
