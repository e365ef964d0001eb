"""Whatever ends a campaign, what is done is kept, and going on gives the bytes of an undisturbed
one.
"""

import random
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from benchmarks import chaos
from suave_des.campaign.campaign import CampaignInterrupted, Progress, resume_campaign, run_campaign
from suave_des.errors import InputError
from suave_des.records import store as stores
from suave_des.records.store import STORE_FILE, MissionOutcome, Store, StoreError
from suave_des.resources import shipped_folder
from tests.helpers import AWKWARD
from tests.helpers.command import has_size, python, wait_until

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
def test_resumed_on_any_number_of_workers_the_bytes_are_the_same(before, after, scenario, tmp_path):
    whole = undisturbed(scenario, 20, tmp_path / "whole")
    with pytest.raises(CampaignInterrupted):
        run_campaign(
            scenario, MANAGERS, 20, 1, before, tmp_path / "out", on_progress=stopped_after(15)
        )
    seen: list[Progress] = []
    resume_campaign(tmp_path / "out", after, on_progress=seen.append)
    assert (tmp_path / "out" / "runs.csv").read_bytes() == whole
    assert seen[0].done > 15  # what was done is not done again
    assert (tmp_path / "out" / "summary.csv").read_bytes() == (
        tmp_path / "whole" / "summary.csv"
    ).read_bytes()
    assert (tmp_path / "out" / "manifest.json").read_bytes() == (
        tmp_path / "whole" / "manifest.json"
    ).read_bytes()


def test_an_interruption_while_earlier_outcomes_are_read_is_one_like_others(
    scenario, tmp_path, monkeypatch
):
    """What was read is still held by the exception then, and must not keep the database locked."""
    interrupted(scenario, tmp_path / "out")

    outcomes = Store.outcomes

    def ctrl_c(
        store: Store, problem_of: Callable[[MissionOutcome], str]
    ) -> Iterator[MissionOutcome]:
        monkeypatch.undo()
        yield next(outcomes(store, problem_of))
        raise KeyboardInterrupt

    monkeypatch.setattr(Store, "outcomes", ctrl_c)
    with pytest.raises(CampaignInterrupted):
        resume_campaign(tmp_path / "out")
    resume_campaign(tmp_path / "out")
    assert (tmp_path / "out" / "runs.csv").read_bytes() == undisturbed(
        scenario, 20, tmp_path / "whole"
    )


def test_a_campaign_that_is_done_may_get_more_runs(scenario, tmp_path):
    undisturbed(scenario, 5, tmp_path / "out")
    whole = undisturbed(scenario, 9, tmp_path / "whole")
    for _ in range(2):  # the second time, nothing is left to do
        resume_campaign(tmp_path / "out", runs=9)
        assert (tmp_path / "out" / "runs.csv").read_bytes() == whole


def test_killed_at_random_moments_the_bytes_are_the_same(scenario, undisturbed_long, tmp_path):
    runs, out = LONG, tmp_path / "out"

    def run(resumes: bool, told: Callable[[object], None]) -> None:
        if resumes:
            resume_campaign(out, on_progress=told)
        else:
            run_campaign(scenario, MANAGERS, runs, 1, out=out, on_progress=told)

    done = chaos.survive_forked(6, random.Random(7), run, out)
    assert done == sorted(done)
    # or the moments showed nothing
    assert len({count for count in done if 0 < count < 2 * runs}) >= 2
    resume_campaign(out)
    assert (out / "runs.csv").read_bytes() == undisturbed_long
    assert sorted(path.name for path in out.iterdir()) == [
        *("campaign.sqlite", "manifest.json", "runs.csv", "summary.csv")
    ]


@pytest.mark.usefixtures("quick_campaigns")
@pytest.mark.parametrize(
    ("kills", "runs"), [(1, LONG), pytest.param(4, 3000, marks=pytest.mark.slow)]
)
def test_killed_with_its_workers_or_without_the_bytes_are_the_same(
    scenario, undisturbed_long, tmp_path, kills, runs
):
    whole = undisturbed_long if runs == LONG else undisturbed(scenario, runs, tmp_path / "whole")
    asked = [str(scenario), "--managers", ",".join(MANAGERS), "--runs", str(runs), "--workers", "2"]
    done = chaos.survive(kills, random.Random(7), tmp_path, asked, longest_s=0.3)
    assert done == sorted(done)
    assert (tmp_path / "out" / "runs.csv").read_bytes() == whole


class TestRefusals:
    @pytest.fixture
    def out(self, tmp_path: Path) -> Path:
        """An interrupted campaign, of which each file is the user's own."""
        for kind, name in (("scenarios", "suave_modes.yaml"), ("ontology", "suave.owl")):
            shutil.copy(shipped_folder(kind) / name, tmp_path)
        (tmp_path / "own.yaml").write_text(
            f"{chaos.SHORT}modes_file: suave_modes.yaml\nknowledge: {{ontologies: [suave.owl]}}\n"
        )
        interrupted(tmp_path / "own.yaml", tmp_path / "out")
        return tmp_path / "out"

    @pytest.mark.parametrize(
        ("file", "old", "new", "difference"),
        [
            (
                "own.yaml",
                "time_limit_s: 60",
                "time_limit_s: 61",
                r"scenario.mission.time_limit_s was 60.0, and is now",
            ),
            ("own.yaml", "seams2023", "release15", r"scenario\.\S+ was "),
            ("suave_modes.yaml", "\n", "\n\n", r"files_sha256\.\S+suave_modes.yaml was "),
            ("suave.owl", "\n", "\n\n", r"files_sha256\.\S+suave.owl was "),
        ],
    )
    def test_other_inputs(self, file, old, new, difference, out):
        path = out.parent / file
        path.write_text(path.read_text().replace(old, new, 1))
        with pytest.raises(InputError, match=rf"out: the campaign cannot be resumed: {difference}"):
            resume_campaign(out)

    def test_a_comment_in_the_scenario_does_not_matter(self, out):
        path = out.parent / "own.yaml"
        path.write_text(f"# a comment\n{path.read_text()}")
        assert resume_campaign(out).done == 40

    def test_another_version_or_fewer_runs(self, out, monkeypatch):
        with pytest.raises(InputError, match=r"runs was 20, and is now 10"):
            resume_campaign(out, runs=10)
        monkeypatch.setattr("suave_des.__version__", "99.0")
        with pytest.raises(
            InputError, match=r"versions.suave-des was '[0-9.]+', and is now '99.0'"
        ):
            resume_campaign(out)

    @pytest.mark.usefixtures("quick_campaigns")
    def test_two_campaigns_on_one_folder(self, scenario, tmp_path):
        process = chaos.start(
            [str(scenario), "--managers", "none", "--runs", "100000", "--out", "out"], tmp_path
        )
        try:
            wait_until(lambda: has_size(tmp_path / "out" / STORE_FILE, 10_000))  # it has begun
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


class TestDisk:
    def test_that_fills_up_as_the_system_tells_it(self, scenario, undisturbed_long, tmp_path):
        """Files may not grow beyond 40 kB: the system refuses to write, as it does on a full
        disk.
        """
        code = (
            "import resource, signal, sys\n"
            "resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))\n"
            "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
            "from suave_des.cli.main import main\n"
            f"main(['campaign', {str(scenario)!r}, '--managers', 'none,random', '--runs', '{LONG}', '--workers', '1',"
            " '--quiet', '--out', 'out'])\n"
        )
        ended = python("-c", code, cwd=tmp_path)
        assert ended.returncode == 3
        assert ended.stderr.count("\n") == 1
        assert "--resume out runs the rest" in ended.stderr
        resume_campaign(tmp_path / "out", 1)
        assert (tmp_path / "out" / "runs.csv").read_bytes() == undisturbed_long

    def test_a_folder_that_is_removed_meanwhile(self, scenario, tmp_path, monkeypatch):
        monkeypatch.setattr(stores, "_COMMIT_PERIOD_S", 0.0)

        def remove(progress: Progress) -> None:
            if progress.done == 7:
                shutil.rmtree(tmp_path / "out")

        with pytest.raises(
            StoreError, match=r"was removed while the campaign ran; .* start a new campaign$"
        ):
            run_campaign(scenario, MANAGERS, 20, 1, out=tmp_path / "out", on_progress=remove)


def test_what_a_killed_campaign_leaves_before_it_began_is_no_hindrance(scenario, tmp_path):
    (tmp_path / "out").mkdir()
    for name in (STORE_FILE, f"{STORE_FILE}-wal"):
        (tmp_path / "out" / name).write_text("")
    assert run_campaign(scenario, ["none"], 2, 1, out=tmp_path / "out").done == 2


def test_missions_that_took_too_long_are_run_again_when_resumed(tmp_path, monkeypatch):
    manager = f"{AWKWARD}:HangsOnce"
    monkeypatch.setenv("AWKWARD_MARKS", str(tmp_path))
    result = run_campaign("seams2023", [manager], 12, 1, out=tmp_path / "out", time_out_s=2.0)
    assert 0 < len(result.failures) < 12
    assert resume_campaign(tmp_path / "out").done == 12
