"""Output folders that come from elsewhere, are damaged, or were left by a command that was killed."""

from __future__ import annotations

import json
import os
import random
import shutil
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from suave_des.campaign import campaign
from suave_des.campaign.campaign import resume_campaign, run_campaign
from suave_des.cli.main import main
from suave_des.errors import InputError, SuaveDesError
from suave_des.files import write_files


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

    @pytest.mark.parametrize("name", [".campaign.lock", "campaign.sqlite-wal", "campaign.sqlite-journal"])
    def test_where_the_campaign_is_resumed(self, received: Path, precious: Path, name: str) -> None:
        (received / name).symlink_to(precious)
        with pytest.raises(InputError, match="is a link, which is not followed"):
            resume_campaign(received, runs=5)

    def test_in_place_of_the_store(self, received: Path, precious: Path) -> None:
        (received / "campaign.sqlite").rename(received / "elsewhere.sqlite")
        (received / "campaign.sqlite").symlink_to(received / "elsewhere.sqlite")
        with pytest.raises(InputError, match="is a link"):
            resume_campaign(received, runs=5)

    def test_where_a_new_campaign_goes(self, precious: Path, tmp_path: Path) -> None:
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / ".campaign.lock").symlink_to(precious)
        with pytest.raises(InputError, match="is a link"):
            run_campaign("seams2023", ["none"], 1, out=tmp_path / "out")

    def test_in_place_of_a_file_that_is_being_written(self, precious: Path, tmp_path: Path) -> None:
        part = tmp_path / f".runs.csv.{os.getpid()}.part"
        part.symlink_to(precious)
        write_files(tmp_path, {"runs.csv": "new"})
        assert (tmp_path / "runs.csv").read_text() == "new"
        assert not (tmp_path / "runs.csv").is_symlink()


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
    def test_of_what_is_noted_is_told_with_a_remedy(self, received: Path, name: str, damage: str) -> None:
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
    def test_of_tables_is_no_traceback(self, received: Path, damage: str) -> None:
        with sqlite3.connect(received / "campaign.sqlite") as store:
            try:
                store.execute(damage)
            except sqlite3.Error as error:  # the table itself refuses it
                pytest.skip(str(error))
        self.resumed(received)

    @pytest.mark.slow
    def test_of_bytes_is_no_traceback(self, received: Path) -> None:
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
    def test_results_of_the_old_campaign_go_before_new_missions_begin(
        self, received: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        found = []

        def killed(*_: object, **__: object) -> None:
            found.extend(path.name for path in received.iterdir())
            raise InputError("killed here")

        monkeypatch.setattr(campaign, "plan", killed)
        with pytest.raises(InputError, match="killed here"):
            run_campaign("release15", ["bt"], 2, 1, out=received, overwrite=True)
        assert not {"runs.csv", "summary.csv", "manifest.json"} & set(found)

    def test_results_of_another_campaign_than_the_store_s_are_not_drawn(
        self, received: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        other = tmp_path / "other"
        run_campaign("seams2023", ["none"], 3, 2, out=other)
        shutil.copy(other / "campaign.sqlite", received / "campaign.sqlite")
        with pytest.raises(SystemExit) as ended:
            main(["figure", str(received), "--out", str(tmp_path / "x.png")])
        assert ended.value.code == 2
        assert "are of different campaigns" in capsys.readouterr().err

    def test_a_campaign_with_more_runs_is_the_same_campaign(self, received: Path) -> None:
        before = json.loads((received / "manifest.json").read_text())["campaign_sha256"]
        resume_campaign(received, runs=4)
        assert json.loads((received / "manifest.json").read_text())["campaign_sha256"] == before


def test_the_time_out_follows_the_reasoner() -> None:
    from suave_des.campaign.inputs import default_time_out_s, read_inputs
    from suave_des.campaign.spec import CampaignSpec

    def default(**options: object) -> float:
        return default_time_out_s(*read_inputs(CampaignSpec.of("seams2023", managers=["none"], **options), None)[:2])

    assert default() == default(reasoner="pellet") == 120
    assert default(reasoner="owlready2") == 1800
    assert default(sweep={"knowledge.reasoner": ["pellet", "owlready2"]}) == 1800
