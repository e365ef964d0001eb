"""What travels to workers of a cluster, and what these do with it; without a cluster."""

import shutil
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from suave_des.campaign.inputs import read_campaign
from suave_des.campaign.missions import Campaign, Finished
from suave_des.campaign.spec import CampaignSpec
from suave_des.interfaces import cluster
from suave_des.records.store import MissionFailure, MissionKey
from suave_des.scenario.loader import LoadedScenario, load_scenario
from suave_des.user_code import user_modules
from tests.helpers import AWKWARD


def campaign(
    *managers: str, loaded: LoadedScenario | None = None, time_out_s: float = 60.0
) -> Campaign:
    return read_campaign(
        CampaignSpec.of("seams2023", managers=managers, time_out_s=time_out_s), None, loaded
    )


@pytest.fixture(autouse=True)
def modules_as_before() -> Iterator[None]:
    """Unpacking in this process replaces modules by those unpacked, whose folder then goes."""
    before = dict(sys.modules)
    yield
    for name in [name for name in sys.modules if name.partition(".")[0] == "tests"]:
        del sys.modules[name]
        if name in before:
            sys.modules[name] = before[name]


class TestOwnModules:
    @pytest.fixture
    def folder(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        monkeypatch.syspath_prepend(tmp_path)
        known = set(sys.modules)
        yield tmp_path
        for name in set(sys.modules) - known:
            del sys.modules[name]

    def test_of_a_manager_what_it_imports_that_is_not_installed(self, folder):
        files = {
            "mine/__init__.py": "",
            "mine/manager.py": "import numpy\nfrom suave_des.managing.simple import NoManager\nfrom . import near\n"
            "import far.away\nfrom mine.deep.down import CONSTANT\nclass M(NoManager):\n"
            "    def adapt(self):\n        import later\n        import not_there_at_all\n",
            "mine/near.py": "from .sibling import name_of_no_module\n",
            "mine/sibling.py": "name_of_no_module = 1\n",
            "mine/not_imported.py": "",
            "mine/deep/__init__.py": "from .. import near\n",
            "mine/deep/down.py": "CONSTANT = 1\n",
            "far/away.py": "",
            "later.py": "import mine.manager\n",
        }
        for place, text in files.items():
            path = folder / place
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        found = user_modules(["mine.manager:M", "none", "metacontrol"], [])
        assert found == {
            place: folder / place for place in files if place != "mine/not_imported.py"
        }

    def test_of_a_script_what_it_imports(self, folder, monkeypatch):
        """Its own classes are sent by value."""
        from suave_des.managing.simple import NoManager

        (folder / "script.py").write_text("import habits\n")
        (folder / "habits.py").write_text("PERIOD_S = 4.0\n")
        mine = type("Mine", (NoManager,), {"__module__": "__main__"})
        monkeypatch.setattr(sys.modules["__main__"], "Mine", mine, raising=False)
        monkeypatch.setattr(
            sys.modules["__main__"], "__file__", str(folder / "script.py"), raising=False
        )
        assert user_modules(["__main__:Mine"], []) == {
            "__main__.py": folder / "script.py",
            "habits.py": folder / "habits.py",
        }


class TestOnAWorker:
    @pytest.fixture(autouse=True)
    def worker(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
        pytest.importorskip("distributed")
        (tmp_path / "scratch").mkdir()
        worker = SimpleNamespace(address="tcp://there:1", local_directory=str(tmp_path / "scratch"))
        monkeypatch.setattr(cluster, "get_worker", lambda: worker)
        yield
        cluster.forget("token")
        assert list((tmp_path / "scratch").iterdir()) == []  # nothing is left behind

    @staticmethod
    def run(parcel: bytes, runs: range) -> list[Finished]:
        return cluster.run("token", parcel, tuple(MissionKey(0, 0, run) for run in runs))

    def test_files_that_managers_declare_travel_each_with_its_own_content(
        self, tmp_path, monkeypatch
    ):
        """Also where two managers have a file of the same name, from different folders."""
        monkeypatch.chdir(tmp_path)
        (tmp_path / "below").mkdir()
        names = [f"{AWKWARD}:Declares", f"{AWKWARD}:DeclaresToo"]
        text = f'base: seams2023\nmanagers: {{"{names[1]}": {{table: table.txt}}}}\n'
        for path, content in (
            ("table.txt", "high"),
            ("below/table.txt", "low"),
            ("below/mine.yaml", text),
        ):
            (tmp_path / path).write_text(content)
        loaded = load_scenario(
            "below/mine.yaml", manager_options={names[0]: {"table": "table.txt"}}
        )
        parcel = cluster.pack(campaign(*names, loaded=loaded))
        shutil.rmtree(tmp_path / "below")
        (tmp_path / "table.txt").unlink()
        self.run(parcel, range(1, 2))
        there = cluster._current["token"][0].campaign.loaded
        files = [there.manager_file(name, "table.txt") for name in names]
        assert [path.read_text() for path in files] == ["high", "low"]
        assert all(
            path.is_relative_to(tmp_path / "scratch") and path.name == "table.txt" for path in files
        )

    def test_a_mission_that_takes_too_long_is_interrupted_in_a_thread_too(self):
        outcomes: list[list[Finished]] = []
        parcel = cluster.pack(campaign(f"{AWKWARD}:HangsInSome", time_out_s=1.0))
        thread = threading.Thread(target=lambda: outcomes.append(self.run(parcel, range(1, 4))))
        thread.start()
        thread.join(60.0)
        (finished,) = outcomes
        assert [isinstance(outcome, MissionFailure) for _, outcome in finished] == [
            False,
            True,
            False,
        ]
        late = finished[1][1]
        assert (late.run, late.time_s, late.lasting) == (2, 50.0, False)
        assert late.cause.startswith(
            "not done after 1 s (time-out), in adapt (awkward_managers.py, line "
        )
