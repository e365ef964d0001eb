"""--overwrite replaces results of the same kind only: a folder never holds a mission beside a
campaign.
"""

import json
import os
import stat
import subprocess
from hashlib import sha256
from pathlib import Path

import pytest

from suave_des.campaign import campaign
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


def refused(told: str, name: str) -> bool:
    """Whether a command has told, in one line, what is wrong with a file of the folder out."""
    return told.count("\n") == 1 and told.startswith(f"suave-des: out/{name}: is not as ")


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


MINE = "mine, and of nobody else\n"


def test_resuming_leaves_what_the_user_has_put_beside_the_exemplar_s_files(command):
    assert command(*CAMPAIGN, "--format", "suave")[0] == 0
    Path("out/suave/mine.csv").write_text(MINE)
    (theirs,) = Path("out/suave").glob("none*.csv")
    assert command("campaign", "--resume", "out")[0] == 0
    assert Path("out/suave/mine.csv").read_text() == MINE and theirs.is_file()


def test_resuming_leaves_an_empty_folder(command):
    assert command(*CAMPAIGN)[0] == 0
    Path("out/suave").mkdir()
    assert command("campaign", "--resume", "out")[0] == 0
    assert Path("out/suave").is_dir()


def test_overwriting_leaves_what_only_has_the_name_of_a_result(command):
    assert command(*CAMPAIGN, "--format", "suave")[0] == 0
    names = ("replay.html", "report.html", "validation.csv", "suave/mine.csv", "paper_table.md")
    for name in names:
        Path("out", name).write_text(MINE)
    assert command(*CAMPAIGN, "--overwrite")[0] == 0
    assert [Path("out", name).read_text() for name in names] == [MINE] * len(names)
    assert not list(Path("out/suave").glob("none*.csv"))


@pytest.mark.parametrize(
    ("first", "name"),
    [
        *(
            (CAMPAIGN, name)
            for name in ("runs.csv", "summary.csv", "ensemble.csv", "manifest.json")
        ),
        *((RUN, name) for name in ("mission.json", "events.csv", "knowledge.jsonl")),
    ],
)
def test_overwriting_refuses_where_a_file_of_the_user_s_would_go(command, first, name):
    assert command(*first)[0] == 0
    content = "{}" if name.endswith("json") else MINE
    Path("out", name).write_text(content)
    before = files()
    done = command(*first, "--overwrite")
    assert done.status == 2 and f"out: has {name}, which " in done.err
    assert files() == before


def _edit(path: Path) -> bytes:
    """Change a file as a user may; return its bytes."""
    if path.name == "manifest.json":
        path.write_text(json.dumps({"note": MINE, **json.loads(path.read_text())}))
    else:
        path.write_bytes(path.read_bytes() + MINE.encode())
    return path.read_bytes()


@pytest.mark.parametrize(
    "again", [("campaign", "--resume", "out", "--runs", "2"), (*CAMPAIGN, "--overwrite")]
)
@pytest.mark.parametrize(
    "name",
    ["runs.csv", "summary.csv", "manifest.json", "knowledge_states.jsonl", "suave/none*.csv"],
)
def test_a_result_file_that_the_user_changed_is_not_replaced(command, name, again):
    assert command(*CAMPAIGN, "--format", "suave", "--record-knowledge")[0] == 0
    (changed,) = Path("out").glob(name)
    content = _edit(changed)
    before = files_in("out")
    done = command(*again)
    assert done.status == 2 and changed.name in done.err
    assert changed.read_bytes() == content
    assert files_in("out") == before
    changed.rename("moved")
    assert command(*again)[0] == 0


def files_in(folder: str) -> dict[Path, bytes]:
    """Return the content of all files but the store, which SQLite marks when it opens it."""
    found = [path for path in Path(folder).rglob("*") if path.is_file()]
    return {path: path.read_bytes() for path in found if path.suffix != ".sqlite"}


def test_a_file_of_the_user_s_that_came_while_missions_ran_is_not_replaced(command, monkeypatch):
    """They are kept in the store, and the files written when it is gone."""
    work = campaign._work

    def with_a_file(*arguments):
        Path("out/summary.csv").write_text(MINE)
        return work(*arguments)

    monkeypatch.setattr(campaign, "_work", with_a_file)
    done = command(*CAMPAIGN)
    assert done.status == 2 and refused(done.err, "summary.csv")
    assert Path("out/summary.csv").read_text() == MINE
    assert not Path("out/runs.csv").exists()


def test_a_folder_that_lacks_one_result_file_may_be_used_again(command):
    """As a campaign that is killed while it removes those of the one before leaves it."""
    assert command(*CAMPAIGN)[0] == 0
    Path("out/summary.csv").unlink()
    assert command(*CAMPAIGN, "--overwrite")[0] == 0


@pytest.mark.parametrize("place", ["{here}/precious.csv", "link/precious.csv", "../precious.csv"])
def test_a_file_elsewhere_that_a_listing_names_stays(command, tmp_path, place):
    Path("precious.csv").write_text(MINE)
    assert command(*CAMPAIGN)[0] == 0
    Path("out/link").symlink_to(tmp_path)
    manifest = json.loads(Path("out/manifest.json").read_text())
    manifest["files_sha256"][place.format(here=tmp_path)] = sha256(MINE.encode()).hexdigest()
    Path("out/manifest.json").write_text(json.dumps(manifest))
    command(*CAMPAIGN, "--overwrite")
    assert Path("precious.csv").read_text() == MINE


@pytest.mark.parametrize("page", ["report", "replay"])
@pytest.mark.parametrize("first", [RUN, CAMPAIGN])
def test_a_page_that_the_user_changed_is_replaced_only_where_it_is_named(command, first, page):
    if first == RUN and page == "report":
        pytest.skip("a report is of a campaign")
    assert command(*first)[0] == 0
    assert command(page, "out")[0] == 0
    assert command(page, "out")[0] == 0
    file = Path(f"out/{page}.html")
    content = _edit(file)
    done = command(page, "out")
    assert done.status == 2 and refused(done.err, file.name)
    assert file.read_bytes() == content
    assert command(page, "out", "--out", str(file))[0] == 0
    assert file.read_bytes() != content


@pytest.mark.parametrize(
    ("again", "name"), [(REPRODUCE, "paper_table.md"), (VALIDATE, "validation.csv")]
)
def test_a_table_that_the_user_changed_is_not_replaced(command, again, name):
    assert command(*again)[0] == 0
    content = _edit(Path("out", name))
    done = command(*again, "--overwrite")
    assert done.status == 2 and refused(done.err, name)
    assert Path("out", name).read_bytes() == content


def test_a_page_that_was_made_of_the_results_goes_with_them(command):
    assert command(*CAMPAIGN)[0] == 0
    assert command("replay", "out")[0] == 0
    assert command(*CAMPAIGN, "--overwrite")[0] == 0
    assert not Path("out/replay.html").exists()


@pytest.mark.parametrize("name", ["trajectory.csv", "events.csv"])
def test_a_mission_beside_files_of_another_is_told(command, name):
    """As a kill between two renames of `run --overwrite` leaves it."""
    assert command(*RUN)[0] == 0
    before = Path("out", name).read_bytes()
    assert command(*RUN, "--seed", "2", "--overwrite")[0] == 0
    Path("out", name).write_bytes(before)
    for words in (["figure", "out", "--out", "m.png"], ["replay", "out"]):
        done = command(*words)
        assert done.status == 2 and refused(done.err, name)


def test_states_of_knowledge_of_an_earlier_mission_are_told(command):
    """As a kill before the last of its files is removed left it."""
    assert command(*RUN, "--manager", "metacontrol")[0] == 0
    before = Path("out/knowledge.jsonl").read_bytes()
    assert command(*RUN, "--overwrite")[0] == 0
    Path("out/knowledge.jsonl").write_bytes(before)
    done = command("replay", "out")
    assert done.status == 2 and refused(done.err, "knowledge.jsonl")


WRITING = {
    "figure": ["figure", "out", "--out"],
    "compare": ["compare", "out", "--out"],
    "report": ["replay", "out", "--out"],
}


@pytest.mark.parametrize(
    ("name", "ending"),
    [("figure", ".png"), ("compare", ".csv"), ("report", ".html")],
)
class TestFiles:
    @pytest.fixture(autouse=True)
    def results(self, command):
        assert command(*CAMPAIGN)[0] == 0

    def test_a_link_is_followed(self, command, name, ending):
        Path("real").mkdir()
        Path("real/file").write_text("old")
        Path(f"link{ending}").symlink_to("real/file")
        assert command(*WRITING[name], f"link{ending}")[0] == 0
        assert Path(f"link{ending}").is_symlink()
        assert Path("real/file").stat().st_size > 10

    def test_a_pipe_is_written_into(self, command, name, ending):
        os.mkfifo(f"pipe{ending}")
        with subprocess.Popen(["cat", f"pipe{ending}"], stdout=subprocess.PIPE) as reader:
            assert command(*WRITING[name], f"pipe{ending}")[0] == 0
            assert len(reader.stdout.read()) > 10
        assert stat.S_ISFIFO(Path(f"pipe{ending}").stat().st_mode)

    def test_a_device_stays_one(self, command, name, ending):
        Path(f"null{ending}").symlink_to(os.devnull)
        assert command(*WRITING[name], f"null{ending}")[0] == 0
        assert stat.S_ISCHR(Path(os.devnull).stat().st_mode)

    def test_a_circle_of_links_is_told(self, command, name, ending):
        Path(f"circle{ending}").symlink_to(f"circle{ending}")
        done = command(*WRITING[name], f"circle{ending}")
        assert done.status == 2 and done.err.count("\n") == 1
