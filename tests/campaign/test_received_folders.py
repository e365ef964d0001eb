"""Output folders that come from elsewhere, are damaged, or were left by a command that was
killed.
"""

import json
import os
import random
import shutil
import sqlite3
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
