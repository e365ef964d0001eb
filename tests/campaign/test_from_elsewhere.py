"""Campaigns of files that lie elsewhere, and campaigns that are resumed: what is found, and what the
manifest says.
"""

import json
import sys
from pathlib import Path

import pytest

from tests.helpers.command import command_here, suave_des_command

MANAGER = """
from suave_des import ManagingSubsystem
from height import HIGH


class High(ManagingSubsystem):
    period_s = 5.0

    def adapt(self):
        self.system.change_mode("f_generate_search_path", HIGH)
"""
CAMPAIGN = """
campaign: 1
scenario: seams2023
managers: [none, "high:High"]
runs: 2
"""


@pytest.fixture
def experiment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a campaign file, and a manager's module with one that it imports, which are not
    loaded yet, nor told of.
    """
    monkeypatch.setattr("suave_des.user_code._told", set())
    for name in ("high", "height"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    folder = tmp_path / "experiment"
    folder.mkdir()
    (folder / "campaign.yaml").write_text(CAMPAIGN)
    (folder / "high.py").write_text(MANAGER)
    (folder / "height.py").write_text('HIGH = "fd_spiral_high"\n')
    (tmp_path / "elsewhere").mkdir()
    return folder


def manifest(folder: Path) -> dict:
    return json.loads((folder / "manifest.json").read_text())


IN_ONE = ("campaign", "../experiment/campaign.yaml", "--workers", "1", "--out", "one")


def test_a_manager_beside_the_campaign_file_is_found_from_elsewhere(experiment, caplog):
    elsewhere = experiment.parent / "elsewhere"
    done = command_here(*IN_ONE, cwd=elsewhere)
    assert done.returncode == 0, done.stderr
    assert "has the code of high:High (../experiment/high.py) run" in caplog.text
    assert (elsewhere / "one" / "runs.csv").read_text().count("high:High") == 2


def test_workers_find_it_too(experiment):
    elsewhere = experiment.parent / "elsewhere"
    command_here(*IN_ONE, cwd=elsewhere)
    in_two = ("../experiment/campaign.yaml", "--workers", "2", "--out", "two")
    done = suave_des_command("campaign", *in_two, cwd=elsewhere)
    assert done.returncode == 0, done.stderr
    one, two = ((elsewhere / name / "runs.csv").read_bytes() for name in ("one", "two"))
    assert one == two


def test_of_two_managers_of_one_name_the_current_folder_s_is_run(experiment, caplog):
    elsewhere = experiment.parent / "elsewhere"
    (elsewhere / "high.py").write_text(MANAGER.replace("from height import HIGH", "HIGH = 'no'"))
    asked = ("../experiment/campaign.yaml", "--runs", "1", "--out", "out")
    command_here("campaign", *asked, cwd=elsewhere)
    assert "the code of high:High (high.py) run" in caplog.text


@pytest.mark.parametrize("asked", [("--runs", "2"), ("--runs=2",), ()], ids=" ".join)
def test_the_manifest_s_command_asks_for_the_runs_that_there_are(tmp_path, asked):
    first = ("campaign", "seams2023", "--managers", "none", *asked, "--out", "out")
    if not asked:
        (tmp_path / "small.yaml").write_text(CAMPAIGN.replace(', "high:High"', ""))
        first = ("campaign", "small.yaml", "--out", "out")
    assert command_here(*first, cwd=tmp_path).returncode == 0
    assert manifest(tmp_path / "out")["command"] == ["suave-des", *first]
    assert command_here("campaign", "--resume", "out", "--runs", "3", cwd=tmp_path).returncode == 0
    kept = [word for word in first if word not in asked]
    assert manifest(tmp_path / "out")["command"] == ["suave-des", *kept, "--runs", "3"]


def test_a_campaign_that_cannot_be_resumed_here_says_where_it_was_begun(experiment):
    assert command_here("campaign", "campaign.yaml", "--out", "out", cwd=experiment).returncode == 0
    elsewhere = experiment.parent / "elsewhere"
    done = command_here("campaign", "--resume", "../experiment/out", cwd=elsewhere)
    assert done.returncode == 2
    begun = f"campaign.yaml: no such file; the campaign was begun in {experiment}, where"
    assert begun in done.stderr
