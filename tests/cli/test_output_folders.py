"""--overwrite replaces results of the same kind only: a folder never holds a mission beside a
campaign.
"""

from pathlib import Path

import pytest

from suave_des.files import FAMILIES

RUN = ("run", "seams2023", "--manager", "none", "--out", "out")
CAMPAIGN = (
    "campaign",
    "seams2023",
    "--managers",
    "none",
    "--runs",
    "1",
    "--workers",
    "1",
    "--out",
    "out",
)
REPRODUCE = ("reproduce", "--runs", "2", "--workers", "1", "--out", "out")
VALIDATE = ("validate", "--managers", "none", "--runs", "2", "--workers", "1", "--out", "out")


def files() -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in Path("out").iterdir()}


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        (CAMPAIGN, RUN, "a campaign's results in it (campaign.sqlite)"),
        (RUN, CAMPAIGN, "a mission's results in it (events.csv)"),
        (RUN, REPRODUCE, "a mission's results in it (events.csv)"),
        (RUN, VALIDATE, "a mission's results in it (events.csv)"),
    ],
)
def test_results_of_another_kind_are_left_alone(command, first, second, found):
    assert command(*first)[0] == 0
    before = files()
    status, _, error = command(*second, "--overwrite")
    assert status == 2
    assert f"out: the output folder has {found}, which this command does not replace" in error
    assert "give another folder" in error
    assert error.count("\n") == 1
    assert files() == before


@pytest.mark.parametrize("first", [REPRODUCE, VALIDATE])
def test_a_new_campaign_takes_away_the_tables_of_the_one_that_it_replaces(command, first):
    assert command(*first)[0] == 0
    Path("out/notes.txt").write_text("mine")
    assert command(*CAMPAIGN, "--overwrite")[0] == 0
    assert set(files()) == {
        "campaign.sqlite",
        "runs.csv",
        "summary.csv",
        "manifest.json",
        "notes.txt",
    }


def test_every_file_that_a_command_writes_is_known(command):
    for arguments, family in (
        (RUN, "mission"),
        (CAMPAIGN, "campaign"),
        (REPRODUCE, "campaign"),
        (VALIDATE, "campaign"),
    ):
        here = (*arguments[:-1], f"{arguments[0]}-out")
        assert command(*here)[0] == 0
        assert {path.name for path in Path(here[-1]).iterdir()} <= set(FAMILIES[family])
