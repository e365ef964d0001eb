"""Output folders that come from elsewhere, are damaged, or were left by a command that was
killed.
"""

import json
import math
import os
import random
import shutil
import sqlite3
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from suave_des.campaign import campaign
from suave_des.campaign.campaign import resume_campaign, run_campaign
from suave_des.campaign.inputs import read_campaign
from suave_des.campaign.spec import CampaignSpec
from suave_des.errors import InputError, SuaveDesError
from suave_des.files import write_files
from suave_des.records.store import _crc, _note
from tests.helpers.command import ends_within


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("finished") / "out"
    run_campaign("seams2023", ["none"], 3, 1, out=folder)
    return folder


@pytest.fixture
def received(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "received"))


NEW = ("campaign", "seams2023", "--runs", "1", "--managers", "none", "--quiet")


class TestLinks:
    """A link in a folder leads to a file of the user's, which must stay as it is."""

    @pytest.fixture
    def precious(self, tmp_path: Path) -> Iterator[Path]:
        path = tmp_path / "precious.txt"
        path.write_text("precious")
        yield path
        assert path.read_text() == "precious"

    @pytest.mark.parametrize(
        ("name", "link"),
        [
            *(("campaign.sqlite-wal", "symlink_to"), ("campaign.sqlite-wal", "hardlink_to")),
            *(
                ("campaign.sqlite-journal", "symlink_to"),
                ("campaign.sqlite-journal", "hardlink_to"),
            ),
            *(("campaign.sqlite", "symlink_to"), ("suave", "symlink_to")),
        ],
    )
    def test_where_the_campaign_is_resumed(self, received, precious, name, link):
        target = {"suave": precious.parent, "campaign.sqlite": received / "elsewhere.sqlite"}.get(
            name, precious
        )
        if name == "campaign.sqlite":
            (received / name).rename(target)
        getattr(received / name, link)(target)
        with pytest.raises(InputError, match=r"is a (hard )?link") as raised:
            resume_campaign(received, runs=5)
        assert raised.value.file == str(received / name)

    def test_where_a_new_campaign_goes(self, precious, tmp_path):
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "campaign.sqlite").symlink_to(precious)
        with pytest.raises(InputError, match="is a link"):
            run_campaign("seams2023", ["none"], 1, out=tmp_path / "out", overwrite=True)

    def test_in_place_of_a_file_that_is_being_written(self, precious, tmp_path):
        part = tmp_path / f".runs.csv.{os.getpid()}.part"
        part.symlink_to(precious)
        write_files(tmp_path, {"runs.csv": "new"})
        assert (tmp_path / "runs.csv").read_text() == "new"
        assert not (tmp_path / "runs.csv").is_symlink()


def journal_that_removes(path: Path, database: Path) -> bytes:
    """A rollback journal that names a file which SQLite removes when the journal is used; see
    section 1.3 of SQLite's file format, and readSuperJournal of pager.c.
    """
    pages = database.stat().st_size // 4096
    magic, name = bytes.fromhex("d9d505f920a163d7"), os.fsencode(path)
    header = magic + struct.pack(">IIIII", 0, 7, pages, 512, 4096)
    end = struct.pack(">II", len(name), sum(name)) + magic
    return header.ljust(512, b"\0") + struct.pack(">I", 2**30 // 4096 + 1) + name + end


class TestJournals:
    @pytest.mark.parametrize(
        "words",
        [
            ["campaign", "--resume", "FOLDER"],
            ["replay", "FOLDER"],
            ["report", "FOLDER"],
            ["compare", "FOLDER"],
            ["figure", "FOLDER", "--out", "x.png"],
            [*NEW, "--overwrite", "--out", "FOLDER"],
        ],
        ids=["resume", "replay", "report", "compare", "figure", "overwrite"],
    )
    def test_that_name_another_file_have_nothing_removed(
        self, received, tmp_path, monkeypatch, command, words
    ):
        monkeypatch.chdir(tmp_path)
        precious = tmp_path / "precious.txt"
        precious.write_text("precious")
        content = journal_that_removes(precious, received / "campaign.sqlite")
        (received / "campaign.sqlite-journal").write_bytes(content)
        done = command(*(received if word == "FOLDER" else word for word in words))
        assert precious.read_text() == "precious"
        is_replaced = "--overwrite" in words
        assert done.status == (0 if is_replaced else 2), done.err

    def test_of_a_write_that_was_killed_are_used(self, received):
        """As a campaign leaves that was killed between the two modes of its journal."""
        before = (received / "runs.csv").read_bytes()
        path = received / "campaign.sqlite"
        killed = (
            f"import os, sqlite3; db = sqlite3.connect({str(path)!r}); db.execute('BEGIN');"
            "db.execute('PRAGMA cache_size = 1'); db.execute('DELETE FROM outcomes');"
            "db.execute('PRAGMA cache_spill = ON'); db.execute('CREATE TABLE x AS SELECT zeroblob(100000)');"
            "os._exit(1)"
        )
        subprocess.run([sys.executable, "-c", killed], check=False)
        assert (received / "campaign.sqlite-journal").stat().st_size > 0
        resume_campaign(received)
        assert (received / "runs.csv").read_bytes() == before

    def test_a_folder_whose_code_is_not_trusted_stays_as_it_is(self, received, command):
        with sqlite3.connect(received / "campaign.sqlite") as db:
            (text,) = db.execute("SELECT value FROM about WHERE name = 'request'").fetchone()
            request = {**json.loads(text), "managers": ["strange:Manager"]}
            db.execute("INSERT OR REPLACE INTO about VALUES (?, ?, ?)", _note("request", request))
        db.close()
        before = {path: path.read_bytes() for path in received.iterdir()}
        done = command("campaign", "--resume", received)
        assert done.status == 2 and "would run the code of strange:Manager" in done.err
        assert {path: path.read_bytes() for path in received.iterdir()} == before


ENDLESS = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT x FROM n"


class TestSchema:
    @pytest.mark.parametrize(
        "change",
        [
            f"DROP TABLE about; CREATE VIEW about AS SELECT 'identity' name, sum(x) value, 1 crc FROM ({ENDLESS})",
            f"DROP TABLE outcomes; CREATE VIEW outcomes AS {ENDLESS}",
            "CREATE TRIGGER t AFTER INSERT ON about BEGIN DELETE FROM outcomes; END",
            "ALTER TABLE outcomes ADD COLUMN more",
            "CREATE TABLE more (x)",
            "CREATE TABLE o2 AS SELECT * FROM outcomes; DROP TABLE outcomes; ALTER TABLE o2 RENAME TO outcomes",
        ],
        ids=["view of about", "view of outcomes", "trigger", "column", "table", "no primary key"],
    )
    def test_that_is_not_ours_is_not_used(self, received, command, tmp_path, change):
        with sqlite3.connect(received / "campaign.sqlite") as db:
            db.executescript(change)
        db.close()
        with ends_within(60):
            for words in (
                ["campaign", "--resume", received],
                ["compare", received],
                ["figure", received, "--out", tmp_path / "x.png"],
            ):
                done = command(*words)
                assert done.status == 2 and "is damaged" in done.err, words


WRONG = (
    None,
    0,
    -1,
    1e400,
    2**70,
    "",
    "x",
    "../x",
    [],
    [1],
    ["a", None],
    {},
    {"a": 1},
    [[[]]],
    True,
)
"""Values that JSON has, in place of what is expected."""


def forgeries(path: Path) -> Iterator[tuple[object, Callable[[sqlite3.Connection], object]]]:
    """Edits of a store after which its checksums are right, each with a name."""
    with sqlite3.connect(path) as db:
        about = {
            name: json.loads(value) for name, value in db.execute("SELECT name, value FROM about")
        }
        rows = [
            json.loads(content)
            for (content,) in db.execute("SELECT content FROM outcomes ORDER BY run")
        ]

    def noted(name: str, value: object) -> Callable[[sqlite3.Connection], object]:
        return lambda db: db.execute(
            "INSERT OR REPLACE INTO about VALUES (?, ?, ?)", _note(name, value)
        )

    def outcome(
        value: object, kind: int = 0, run: object = 1
    ) -> Callable[[sqlite3.Connection], object]:
        content = json.dumps(value)
        crc = _crc(0, 0, run, kind, content)
        statement = "INSERT OR REPLACE INTO outcomes VALUES (0, 0, ?, ?, ?, ?)"
        return lambda db: db.execute(statement, (run, kind, content, crc))

    for name in ("request", "deciding", "remarks"):
        for value in WRONG:
            yield (name, value), noted(name, value)
    for name in ("request", "deciding"):
        for key in about[name]:
            for value in WRONG[:: 1 if name == "request" else 4]:
                yield (name, key, value), noted(name, {**about[name], key: value})
    for value in (
        *WRONG,
        *([*rows[0][:place], wrong, *rows[0][place + 1 :]] for place in (7, 8) for wrong in WRONG),
    ):
        for kind in (0, 1, 2, 7):
            yield (kind, value), outcome(value, kind)
    for run in (0, -5, 2**62, 9):
        yield run, outcome(rows[0], run=run)


class TestDamage:
    def resumed(self, folder: Path) -> None:
        """Resume; an error must name the file and a remedy."""
        try:
            resume_campaign(folder, runs=4)
        except SuaveDesError as error:
            assert "campaign.sqlite" in str(error) or str(folder) in str(error)
            assert "(" in str(error)

    @pytest.mark.parametrize("name", ["request", "deciding", "identity"])
    @pytest.mark.parametrize(
        "damage", ["UPDATE about SET value = '[]'", "UPDATE about SET crc = 1", "DELETE FROM about"]
    )
    def test_of_what_is_noted_is_told_with_a_remedy(self, received, name, damage):
        with sqlite3.connect(received / "campaign.sqlite") as store:
            store.execute(f"{damage} WHERE name = '{name}'")
        if name == "identity":
            self.resumed(received)  # it is noted anew
            return
        with pytest.raises(InputError, match="is damaged") as caught:
            resume_campaign(received, runs=4)
        assert str(caught.value.file).endswith("campaign.sqlite")
        assert "--overwrite" in str(caught.value.remedy)

    @pytest.mark.parametrize(
        "damage",
        [
            "UPDATE about SET value = x'ff00'",
            "UPDATE about SET value = 7",
            "UPDATE about SET crc = 'x'",
            "DROP TABLE about",
            "DROP TABLE outcomes",
            "UPDATE outcomes SET content = x'ff'",
            "UPDATE outcomes SET content = 3",
            "UPDATE outcomes SET kind = 'x'",
            "UPDATE outcomes SET crc = NULL",
            "UPDATE outcomes SET run = 'x' WHERE run = 1",
            "ALTER TABLE about DROP COLUMN crc",
            "PRAGMA user_version = 9",
        ],
    )
    def test_of_tables_is_no_traceback(self, received, damage):
        with sqlite3.connect(received / "campaign.sqlite") as store:
            try:
                store.execute(damage)
            except sqlite3.Error as error:  # the table itself refuses it
                pytest.skip(str(error))
        self.resumed(received)

    @pytest.mark.parametrize(
        "part", [0, *(pytest.param(part, marks=pytest.mark.slow) for part in range(1, 8))]
    )
    def test_of_what_has_the_right_checksum_is_no_traceback(self, received, part):
        """As somebody would forge it who knows the program."""
        whole = (received / "campaign.sqlite").read_bytes()
        for name, edit in list(forgeries(received / "campaign.sqlite"))[part::8]:
            (received / "campaign.sqlite").write_bytes(whole)
            with sqlite3.connect(received / "campaign.sqlite") as db:
                edit(db)
            db.close()
            with ends_within(60):
                try:
                    resume_campaign(received, runs=4)
                except SuaveDesError as error:
                    assert len(str(error).splitlines()) == 1, name

    @pytest.mark.parametrize(
        ("key", "cell", "value"),
        [
            ((0, 0, 99), None, None),
            ((0, 1, 1), None, None),
            ((1, 0, 1), None, None),
            ((0, 0, 1), 1, "random"),
            ((0, 0, 1), 2, 2),
            ((0, 0, 1), 3, 9),
            ((0, 0, 1), 7, 1),
            ((0, 0, 1), 8, "1.0"),
            ((0, 0, 1), 8, math.inf),
            ((0, 0, 1), 8, 1e30),
        ],
    )
    def test_an_outcome_that_is_not_of_the_campaign_is_told(self, received, key, cell, value):
        with sqlite3.connect(received / "campaign.sqlite") as db:
            (content,) = db.execute("SELECT content FROM outcomes WHERE run = 1").fetchone()
            cells = json.loads(content)
            if cell is not None:
                cells[cell] = value
            text = json.dumps(cells)
            statement = "INSERT OR REPLACE INTO outcomes VALUES (?, ?, ?, 0, ?, ?)"
            db.execute(statement, (*key, text, _crc(*key, 0, text)))
        db.close()
        with pytest.raises(InputError, match="is damaged"):
            resume_campaign(received)

    @pytest.mark.parametrize(
        ("damage", "told"),
        [
            (
                "UPDATE outcomes SET content = replace(content, '2.5', '2.6') WHERE run = 3",
                "the outcome of run 3 is",
            ),
            (b"something else " * 100, "file is not a database"),
            (None, r"[\s\S]*start a new campaign with --overwrite"),
            (b"", "there is no campaign in it"),  # as one that was killed at its very start leaves
        ],
    )
    def test_of_the_file_or_one_digit_is_told(self, received, damage, told):
        path = received / "campaign.sqlite"
        if isinstance(damage, str):
            with sqlite3.connect(path) as store:
                store.execute(damage)
            store.close()
        else:
            size = path.stat().st_size
            path.write_bytes(
                path.read_bytes()[: size // 3] + b"\xff" * (size * 2 // 3)
                if damage is None
                else damage
            )
        with pytest.raises(InputError, match=told):
            resume_campaign(received)

    @pytest.mark.slow
    def test_of_bytes_is_no_traceback(self, received):
        whole = (received / "campaign.sqlite").read_bytes()
        stream = random.Random(1)
        for _ in range(300):
            content = bytearray(whole)
            for _ in range(stream.choice((1, 4, 64))):
                content[stream.randrange(len(content))] = stream.randrange(256)
            if stream.random() < 0.2:
                del content[stream.randrange(len(content)) :]
            (received / "campaign.sqlite").write_bytes(content)
            self.resumed(received)


class TestOverwrite:
    def test_results_of_the_old_campaign_go_before_new_missions_begin(self, received, monkeypatch):
        found = []

        def killed(*_: object, **__: object) -> None:
            found.extend(path.name for path in received.iterdir())
            raise InputError("killed here")

        monkeypatch.setattr(campaign, "_work", killed)
        with pytest.raises(InputError, match="killed here"):
            run_campaign("release15", ["bt"], 2, 1, out=received, overwrite=True)
        assert not {"runs.csv", "summary.csv", "manifest.json"} & set(found)

    def test_results_of_another_campaign_than_the_store_s_are_not_drawn(
        self, received, tmp_path, command
    ):
        other = tmp_path / "other"
        run_campaign("seams2023", ["none"], 3, 2, out=other)
        shutil.copy(other / "campaign.sqlite", received / "campaign.sqlite")
        status, _, error = command("figure", received, "--out", tmp_path / "x.png")
        assert status == 2 and "are of different campaigns" in error


def test_the_time_out_follows_the_reasoner():
    def default(**options: object) -> float:
        return read_campaign(
            CampaignSpec.of("seams2023", managers=["none"], **options), None
        ).spec.time_out_s

    assert default() == default(reasoner="pellet") == 120
    assert default(reasoner="owlready2") == 1800
    assert default(reasoner="owlready2", time_out_s=5) == 5
