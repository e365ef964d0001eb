"""What is seen of a campaign while it runs: on a terminal, in a notebook, in a log, and with --quiet."""

from __future__ import annotations

import io
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from rich.console import Console

from benchmarks import chaos
from suave_des.campaign import progress as display
from suave_des.campaign.campaign import CampaignInterrupted, resume_campaign, run_campaign
from suave_des.campaign.progress import Progress
from tests.helpers import AWKWARD


def shown_on(console: Console, label: str = "seams2023", *, quiet: bool = False) -> None:
    """Show a campaign that goes on for a while."""
    with display.shown(label, console, quiet=quiet) as show:
        for done in range(41):
            if show is not None:
                show(Progress(done, int(done > 6), 80))


@pytest.mark.parametrize("width", [40, 120])
def test_on_a_terminal_it_fits_and_is_gone_at_the_end(width: int) -> None:
    text = io.StringIO()
    shown_on(Console(file=text, force_terminal=True, width=width, color_system=None))
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text.getvalue()).replace("\r", "\n")
    assert all(len(line) <= width for line in plain.splitlines())
    assert [line for line in plain.splitlines() if line][-1].startswith("seams2023: 40 of 80")
    assert width < 100 or re.search(r"40 of 80 missions, 1 failed, [\d,]+/s, [\w ]+ left", plain)
    assert text.getvalue().rstrip().endswith("\x1b[2K")  # lines are erased, and nothing comes after


class TestLines:
    def test_a_short_campaign_has_none(self) -> None:
        text = io.StringIO()
        shown_on(Console(file=text))
        assert text.getvalue() == ""

    @pytest.mark.parametrize("terminal", [{}, {"force_terminal": True, "_environ": {"TERM": "dumb"}}])
    def test_a_long_one_has_some_and_a_last_one(
        self, terminal: dict[str, Any], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(display, "_FIRST_LINE_S", 0.0)
        text = io.StringIO()
        shown_on(Console(file=text, width=40, **terminal), "my[bold]file.yaml")
        first, *_, last = text.getvalue().splitlines()
        assert first.startswith("suave-des: my[bold]file.yaml: ")
        assert re.match(r"suave-des: my\[bold]file.yaml: 40 of 80 missions, 1 failed(,|$)", last)

    @pytest.mark.parametrize("is_terminal", [False, True])
    def test_quiet_means_nothing(self, is_terminal: bool, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(display, "_FIRST_LINE_S", 0.0)
        text = io.StringIO()
        shown_on(Console(file=text, force_terminal=is_terminal), quiet=True)
        assert text.getvalue() == ""


def test_in_a_notebook_one_output_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a stand-in for the name of IPython that is used, as it is documented."""
    outputs: list[list[str]] = []

    class Handle:
        def update(self, data: dict[str, str], *, raw: bool) -> None:
            assert raw
            outputs[-1].append(data["text/plain"])

    def show(data: dict[str, str], *, raw: bool, display_id: bool) -> Handle:
        assert raw and display_id
        outputs.append([data["text/plain"]])
        return Handle()

    package, module = ModuleType("IPython"), ModuleType("IPython.display")
    module.display = show  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", package)
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    shown_on(Console(force_jupyter=True))
    (updates,) = outputs
    assert "starting" in updates[0]
    assert updates[-1].startswith("seams2023: 40 of 80 missions, 1 failed")


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.usefixtures("quick_workers")
def test_the_last_that_is_told_is_what_the_result_says(workers: int) -> None:
    seen: list[Progress] = []
    result = run_campaign("seams2023", ["none", f"{AWKWARD}:RaisesInHalf"], 12, 1, workers, on_progress=seen.append)
    assert seen[-1] == Progress(24, len(result.failures), 24)


def test_resumed_it_goes_on_from_what_is_done(tmp_path: Path) -> None:
    scenario = tmp_path / "short.yaml"
    scenario.write_text(chaos.SHORT)

    def ctrl_c(progress: Progress) -> None:
        if progress.done >= 8:
            raise KeyboardInterrupt

    with pytest.raises(CampaignInterrupted):
        run_campaign(scenario, ["none"], 20, 1, out=tmp_path / "out", on_progress=ctrl_c)
    seen: list[Progress] = []
    resume_campaign(tmp_path / "out", on_progress=seen.append)
    assert [one.done for one in seen] == [*range(9, 21)]
