"""Names of managers as a paper's readers are to see them."""

import contextlib
import json
import re
from pathlib import Path
from typing import Any

import pytest

from suave_des.pages.report import report_page
from tests.helpers.command import command_here

PUBLISHED = Path(__file__).parents[2] / "scenarios" / "published" / "seams2023_runs.csv"


@pytest.mark.parametrize("form", ["table", "csv", "markdown", "latex"])
def test_a_label_only_replaces_the_name(tmp_path, form):
    asked = ("compare", str(PUBLISHED), "--format", form)
    plain = command_here(*asked, "--managers", "none,metacontrol", cwd=tmp_path).stdout
    labelled = command_here(
        *asked, "--label", "metacontrol=mros-system", "--managers", "none,mros-system", cwd=tmp_path
    ).stdout
    assert "mros-system" in labelled and "metacontrol" not in labelled
    assert labelled.replace("mros-system", "metacontrol") == plain


def test_figures_take_them_too(tmp_path):
    asked = ("figure", str(PUBLISHED), "--out", "f.svg", "--label", "metacontrol=MROS")
    assert command_here(*asked, cwd=tmp_path).returncode == 0
    assert "MROS" in (tmp_path / "f.svg").read_text()


@pytest.mark.parametrize(
    ("label", "problem"),
    [
        ("none", "--label: 'none' is no NAME=TEXT"),
        ("=x", "is no NAME=TEXT"),
        ("none= ", "is no NAME=TEXT"),
        ("non=x", "there is no mission of 'non' (did you mean 'none'?"),
        ("none=random", "several managers would be shown as 'random'"),
    ],
)
def test_a_label_that_cannot_be_used_is_bad_input(tmp_path, label, problem):
    done = command_here("compare", str(PUBLISHED), "--label", label, cwd=tmp_path)
    assert done.returncode == 2 and problem in done.stderr


CAMPAIGN = """
campaign: 1
scenario: seams2023
managers: [none, bt]
labels: {none: No adaptation}
runs: 3
"""


@pytest.fixture(scope="module")
def labelled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the campaign of a file that has a label, in `out`."""
    folder = tmp_path_factory.mktemp("labelled")
    (folder / "c.yaml").write_text(CAMPAIGN)
    done = command_here("campaign", "c.yaml", "--out", "out", cwd=folder)
    assert done.returncode == 0 and "No adaptation " in done.stdout
    return folder


def content_of(page: str) -> dict[str, Any]:
    return json.loads(re.search(r'application/json"[^>]*>(.*?)</script>', page, re.DOTALL).group(1))


@pytest.mark.parametrize("form", ["table", "latex"])
def test_a_campaign_file_s_label_stands_in_tables(labelled, form):
    shown = command_here("compare", "out", "--format", form, cwd=labelled).stdout
    assert "No adaptation" in shown
    assert not re.search(r"^(none|bt - none) ", shown, re.MULTILINE)


def test_a_campaign_file_s_label_stands_in_figures(labelled):
    assert command_here("figure", "out", "--out", "f.svg", cwd=labelled).returncode == 0
    assert "No adaptation" in (labelled / "f.svg").read_text()


@pytest.fixture(scope="module")
def report(labelled: Path) -> dict[str, Any]:
    """What the report of the campaign shows."""
    with contextlib.chdir(labelled):
        return content_of(report_page([Path("out")]))


def test_a_campaign_file_s_label_stands_in_the_report(report):
    assert report["results"]["drawn"]["groups"] == ["No adaptation", "bt"]


def test_the_report_replays_managers_by_their_names(report):
    assert report["results"]["drawn"]["managers"] == ["none", "bt"]


def test_a_report_of_labelled_managers_has_their_ways(report):
    assert {path["group"] for path in report["ways"]["paths"]} == {0, 1}


@pytest.mark.parametrize("name", ["none", "No adaptation"])
def test_a_manager_is_chosen_by_its_name_or_label(labelled, name):
    asked = ("compare", "out", "--managers", f"bt,{name}", "--against", name)
    assert "No adaptation" in command_here(*asked, cwd=labelled).stdout


def test_the_command_that_replays_has_the_names_of_managers(labelled):
    shown = " ".join(command_here("compare", "out", cwd=labelled).stdout.split())
    assert re.search(r"suave-des replay out --run \d --managers none,bt", shown)


def test_the_command_s_label_goes_before_the_file_s(labelled):
    shown = command_here("compare", "out", "--label", "none=Nobody", cwd=labelled).stdout
    assert "Nobody" in shown and "No adaptation" not in shown


@pytest.mark.parametrize(
    ("labels", "problem"),
    [
        ("{non: x}", "there is no manager 'non' (did you mean 'none'?"),
        ("{none: bt}", "several managers would be shown as 'bt'"),
        ("{none: ''}", "labels.none"),
    ],
)
def test_labels_of_a_file_that_cannot_be_used_are_told_with_their_line(tmp_path, labels, problem):
    text = CAMPAIGN
    (tmp_path / "c.yaml").write_text(text.replace("{none: No adaptation}", labels))
    done = command_here("campaign", "c.yaml", "--out", "out", cwd=tmp_path)
    assert done.returncode == 2 and "c.yaml: line 5, labels.non" in done.stderr
    assert problem in done.stderr
