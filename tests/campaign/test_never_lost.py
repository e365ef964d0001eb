"""Whatever ends a campaign, what is done is kept, and going on gives the bytes of an undisturbed one."""

from __future__ import annotations

import os
import random
import shutil
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import suave_des
from benchmarks import chaos
from suave_des.campaign.campaign import CampaignInterrupted, Progress, resume_campaign, run_campaign
from suave_des.errors import InputError
from suave_des.records import store as stores
from suave_des.records.store import STORE_FILE, Outcome, Store, StoreError, has_campaign
from tests.helpers import AWKWARD

MANAGERS = ["none", "random"]


def undisturbed(scenario: Path, runs: int, folder: Path) -> bytes:
    run_campaign(scenario, MANAGERS, runs, 1, out=folder)
    return (folder / "runs.csv").read_bytes()


LONG = 400
"""Runs of each manager in a campaign that has to be killed while it goes on."""


@pytest.fixture(scope="module")
def undisturbed_long(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("long")
    (folder / "short.yaml").write_text(chaos.SHORT)
    return undisturbed(folder / "short.yaml", LONG, folder / "whole")


def stopped_after(missions: int):
    """What stops a campaign by Ctrl-C when so many missions are done."""

    def ctrl_c(progress: Progress) -> None:
        if progress.done >= missions:
            raise KeyboardInterrupt

    return ctrl_c


def interrupted(scenario: Path, folder: Path, runs: int = 20, missions: int = 15) -> None:
    with pytest.raises(CampaignInterrupted, match=r"suave-des campaign --resume .* runs the rest"):
        run_campaign(scenario, MANAGERS, runs, 1, out=folder, on_progress=stopped_after(missions))


@pytest.mark.parametrize(("before", "after"), [(1, 1), (1, 2), (2, 1)])
@pytest.mark.usefixtures("quick_workers")
def test_resumed_on_any_number_of_workers_the_bytes_are_the_same(
    before: int, after: int, scenario: Path, tmp_path: Path
) -> None:
    whole = undisturbed(scenario, 20, tmp_path / "whole")
    with pytest.raises(CampaignInterrupted):
        run_campaign(scenario, MANAGERS, 20, 1, before, tmp_path / "out", on_progress=stopped_after(15))
    seen: list[Progress] = []
    resume_campaign(tmp_path / "out", after, on_progress=seen.append)
    assert (tmp_path / "out" / "runs.csv").read_bytes() == whole
    assert seen[0].done > 15  # what was done is not done again
    assert (tmp_path / "out" / "summary.csv").read_bytes() == (tmp_path / "whole" / "summary.csv").read_bytes()
    assert (tmp_path / "out" / "manifest.json").read_bytes() == (tmp_path / "whole" / "manifest.json").read_bytes()


def test_an_interruption_while_earlier_outcomes_are_read_is_one_like_others(
    scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was read is still held by the exception then, and must not keep the database locked."""
    interrupted(scenario, tmp_path / "out")

    outcomes = Store.outcomes

    def ctrl_c(store: Store) -> Iterator[Outcome]:
        monkeypatch.undo()
        yield next(outcomes(store))
        raise KeyboardInterrupt

    monkeypatch.setattr(Store, "outcomes", ctrl_c)
    with pytest.raises(CampaignInterrupted):
        resume_campaign(tmp_path / "out")
    resume_campaign(tmp_path / "out")
    assert (tmp_path / "out" / "runs.csv").read_bytes() == undisturbed(scenario, 20, tmp_path / "whole")


def test_a_campaign_that_is_done_may_get_more_runs(scenario: Path, tmp_path: Path) -> None:
    undisturbed(scenario, 5, tmp_path / "out")
    whole = undisturbed(scenario, 9, tmp_path / "whole")
    for _ in range(2):  # the second time, nothing is left to do
        resume_campaign(tmp_path / "out", runs=9)
        assert (tmp_path / "out" / "runs.csv").read_bytes() == whole


def test_killed_at_random_moments_the_bytes_are_the_same(
    scenario: Path, undisturbed_long: bytes, tmp_path: Path
) -> None:
    runs, out = LONG, tmp_path / "out"

    def run(resumes: bool, told: Callable[[object], None]) -> None:
        if resumes:
            resume_campaign(out, on_progress=told)
        else:
            run_campaign(scenario, MANAGERS, runs, 1, out=out, on_progress=told)

    done = chaos.survive_forked(6, random.Random(7), run, out)
    assert done == sorted(done)
    assert len({count for count in done if 0 < count < 2 * runs}) >= 2  # or the moments showed nothing
    resume_campaign(out)
    assert (out / "runs.csv").read_bytes() == undisturbed_long
    assert sorted(path.name for path in out.iterdir()) == [
        *("campaign.sqlite", "manifest.json", "runs.csv", "summary.csv"),
    ]


@pytest.mark.usefixtures("quick_campaigns")
@pytest.mark.parametrize(("kills", "runs"), [(1, LONG), pytest.param(4, 3000, marks=pytest.mark.slow)])
def test_killed_with_its_workers_or_without_the_bytes_are_the_same(
    scenario: Path, undisturbed_long: bytes, tmp_path: Path, kills: int, runs: int
) -> None:
    whole = undisturbed_long if runs == LONG else undisturbed(scenario, runs, tmp_path / "whole")
    asked = [str(scenario), "--managers", ",".join(MANAGERS), "--runs", str(runs), "--workers", "2"]
    done = chaos.survive(kills, random.Random(7), tmp_path, asked, longest_s=0.3)
    assert done == sorted(done)
    assert (tmp_path / "out" / "runs.csv").read_bytes() == whole


class TestRefusals:
    @pytest.mark.parametrize(
        ("change", "difference"),
        [
            (
                "base: seams2023.yaml\nmission: {time_limit_s: 61}\n",
                r"scenario.mission.time_limit_s was 60.0, and is now 61",
            ),
            ("base: release15.yaml\nmission: {time_limit_s: 60}\n", r"scenario\.\S+ was "),
        ],
    )
    def test_another_scenario(self, change: str, difference: str, scenario: Path, tmp_path: Path) -> None:
        interrupted(scenario, tmp_path / "out")
        scenario.write_text(change)
        with pytest.raises(InputError, match=rf"out: the campaign cannot be resumed: {difference}"):
            resume_campaign(tmp_path / "out")

    def test_a_comment_in_the_scenario_does_not_matter(self, scenario: Path, tmp_path: Path) -> None:
        interrupted(scenario, tmp_path / "out")
        scenario.write_text(f"# a comment\n{chaos.SHORT}")
        assert resume_campaign(tmp_path / "out").done == 40

    def test_other_modes_or_ontologies(self, tmp_path: Path) -> None:
        from suave_des.resources import shipped_folder

        modes, ontology = tmp_path / "modes.yaml", tmp_path / "own.owl"
        shutil.copy(shipped_folder("scenarios") / "suave_modes.yaml", modes)
        shutil.copy(shipped_folder("ontology") / "suave.owl", ontology)
        scenario = tmp_path / "short.yaml"
        scenario.write_text(f"{chaos.SHORT}modes_file: modes.yaml\nknowledge: {{ontologies: [own.owl]}}\n")
        for path in (modes, ontology):
            before = path.read_text()
            folder = tmp_path / f"out_{path.name}"
            interrupted(scenario, folder)
            path.write_text(before.replace("\n", "\n\n", 3))
            with pytest.raises(InputError, match=rf"files_sha256\.{path} was "):
                resume_campaign(folder)
            path.write_text(before)

    def test_another_version(self, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        interrupted(scenario, tmp_path / "out")
        monkeypatch.setattr("suave_des.__version__", "99.0")
        with pytest.raises(InputError, match=r"versions.suave-des was '[0-9.]+', and is now '99.0'"):
            resume_campaign(tmp_path / "out")

    def test_fewer_runs(self, scenario: Path, tmp_path: Path) -> None:
        interrupted(scenario, tmp_path / "out")
        with pytest.raises(InputError, match=r"runs was 20, and is now 10"):
            resume_campaign(tmp_path / "out", runs=10)

    def test_a_folder_without_a_campaign(self, tmp_path: Path) -> None:
        (tmp_path / STORE_FILE).write_text("")  # as one that was killed at its very start leaves
        with pytest.raises(InputError, match="there is no campaign in it"):
            resume_campaign(tmp_path)

    def test_a_new_campaign_in_the_folder_of_another(self, scenario: Path, tmp_path: Path) -> None:
        interrupted(scenario, tmp_path / "out")
        with pytest.raises(InputError, match=r"not empty: .*--resume .* continues it, --overwrite replaces it"):
            run_campaign(scenario, MANAGERS, 20, 1, out=tmp_path / "out")

    @pytest.mark.usefixtures("quick_campaigns")
    def test_two_campaigns_on_one_folder(self, scenario: Path, tmp_path: Path) -> None:
        process = chaos.start([str(scenario), "--managers", "none", "--runs", "100000", "--out", "out"], tmp_path)
        try:
            started = time.monotonic()
            while not has_campaign(tmp_path / "out"):
                assert time.monotonic() < started + 60
                time.sleep(0.05)
            taken = "another campaign is running in the output folder"
            with pytest.raises(InputError, match=taken):
                resume_campaign(tmp_path / "out")
            with pytest.raises(InputError, match=taken):
                run_campaign(scenario, MANAGERS, 1, 1, out=tmp_path / "out", overwrite=True)
        finally:
            process.kill()
            process.communicate()
        with pytest.raises(CampaignInterrupted):  # the lock went with the process that held it
            resume_campaign(tmp_path / "out", on_progress=stopped_after(1))


class TestDamage:
    def test_of_the_file(self, scenario: Path, tmp_path: Path) -> None:
        interrupted(scenario, tmp_path / "out")
        path = tmp_path / "out" / STORE_FILE
        content = bytearray(path.read_bytes())
        content[len(content) // 3 :] = b"\xff" * (len(content) - len(content) // 3)
        path.write_bytes(content)
        with pytest.raises(
            InputError, match=r"campaign.sqlite: is damaged: [\s\S]*start a new campaign with --overwrite"
        ):
            resume_campaign(tmp_path / "out")

    def test_of_one_digit(self, scenario: Path, tmp_path: Path) -> None:
        interrupted(scenario, tmp_path / "out")
        with sqlite3.connect(tmp_path / "out" / STORE_FILE) as db:
            db.execute("UPDATE outcomes SET content = replace(content, '2.5', '2.6') WHERE run = 3")
        db.close()
        with pytest.raises(InputError, match=r"is damaged: the outcome of run 3 is not what was written"):
            resume_campaign(tmp_path / "out")

    def test_a_file_that_is_no_store(self, tmp_path: Path) -> None:
        (tmp_path / STORE_FILE).write_text("something else " * 100)
        with pytest.raises(InputError, match="is damaged: file is not a database"):
            resume_campaign(tmp_path)


class TestDisk:
    def test_that_fills_up_during_the_campaign(
        self, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        whole = undisturbed(scenario, 60, tmp_path / "whole")
        real = Store.__init__

        def small(store: Store, path: Path | None, **options: bool) -> None:
            real(store, path, **options)
            store._db.execute("PRAGMA max_page_count = 6")  # SQLite then says what it says when the disk is full

        with monkeypatch.context() as patch:
            patch.setattr(Store, "__init__", small)
            patch.setattr(stores, "_COMMIT_PERIOD_S", 0.0)
            with pytest.raises(StoreError, match=r"database or disk is full; what was kept .*--resume .*runs the rest"):
                run_campaign(scenario, MANAGERS, 60, 1, out=tmp_path / "out")
        assert not (tmp_path / "out" / "runs.csv").exists()
        seen: list[Progress] = []
        resume_campaign(tmp_path / "out", on_progress=seen.append)
        assert seen[0].done > 10
        assert (tmp_path / "out" / "runs.csv").read_bytes() == whole

    def test_that_fills_up_as_the_system_tells_it(
        self, scenario: Path, undisturbed_long: bytes, tmp_path: Path
    ) -> None:
        """Files may not grow beyond 40 kB: the system refuses to write, as it does on a full disk."""
        code = (
            "import resource, signal, sys\n"
            "resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))\n"
            "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
            "from suave_des.cli.main import main\n"
            f"main(['campaign', {str(scenario)!r}, '--managers', 'none,random', '--runs', '{LONG}', '--workers', '1',"
            " '--quiet', '--out', 'out'])\n"
        )
        ended = subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(Path(suave_des.__file__).parents[1])},
            capture_output=True,
            text=True,
            check=False,
        )
        assert ended.returncode == 3
        assert ended.stderr.count("\n") == 1
        assert "--resume out runs the rest" in ended.stderr
        resume_campaign(tmp_path / "out", 1)
        assert (tmp_path / "out" / "runs.csv").read_bytes() == undisturbed_long

    def test_a_folder_that_is_removed_meanwhile(
        self, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(stores, "_COMMIT_PERIOD_S", 0.0)

        def remove(progress: Progress) -> None:
            if progress.done == 7:
                shutil.rmtree(tmp_path / "out")

        with pytest.raises(StoreError, match=r"was removed while the campaign ran; .* start a new campaign$"):
            run_campaign(scenario, MANAGERS, 20, 1, out=tmp_path / "out", on_progress=remove)


def test_what_a_killed_campaign_leaves_before_it_began_is_no_hindrance(scenario: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    for name in (STORE_FILE, f"{STORE_FILE}-wal"):
        (tmp_path / "out" / name).write_text("")
    assert run_campaign(scenario, ["none"], 2, 1, out=tmp_path / "out").done == 2


def test_missions_that_took_too_long_are_run_again_when_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    manager = f"{AWKWARD}:HangsOnce"
    monkeypatch.setenv("AWKWARD_MARKS", str(tmp_path))
    result = run_campaign("seams2023", [manager], 12, 1, out=tmp_path / "out", time_out_s=2.0)
    assert 0 < len(result.failures) < 12
    assert resume_campaign(tmp_path / "out").done == 12
