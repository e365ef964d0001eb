"""What travels to workers of a cluster, and what these do with it; without a cluster."""

from __future__ import annotations

import pickle
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from suave_des.campaign.executors import dask_worker
from suave_des.campaign.executors.dask_worker import Parcel, Unpacked, pack
from suave_des.campaign.executors.mission_runner import MissionRunner
from suave_des.campaign.missions import Finished, JobSpec, MissionFailure, MissionKey
from suave_des.campaign.user_modules import user_modules
from suave_des.campaign.variation import Variation
from suave_des.errors import InputError, KnowledgeError
from suave_des.scenario.loader import load_scenario
from tests.helpers import AWKWARD


def job(*managers: str, time_out_s: float = 60.0) -> JobSpec:
    return JobSpec(load_scenario("seams2023"), Variation(), managers, 1, time_out_s)


@pytest.fixture(autouse=True)
def modules_as_before() -> Iterator[None]:
    """Unpacking in this process replaces modules by those unpacked, whose folder then goes."""
    before = dict(sys.modules)
    yield
    for name, module in before.items():
        if name.partition(".")[0] == "tests":
            sys.modules[name] = module


class TestOwnModules:
    @pytest.fixture
    def folder(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        monkeypatch.syspath_prepend(tmp_path)
        known = set(sys.modules)
        yield tmp_path
        for name in set(sys.modules) - known:
            del sys.modules[name]

    def test_all_that_a_manager_imports_and_nothing_that_is_installed(self, folder: Path) -> None:
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
        found = user_modules(["mine.manager:M", "none", "metacontrol"])
        assert found == {place: folder / place for place in files if place != "mine/not_imported.py"}

    def test_a_class_from_another_module_brings_both(self, folder: Path) -> None:
        (folder / "facade.py").write_text("from behind import M\n")
        (folder / "behind.py").write_text(
            "from suave_des.managing.simple import NoManager\nclass M(NoManager):\n    pass\n"
        )
        assert set(user_modules(["facade:M"])) == {"facade.py", "behind.py"}

    def test_a_script_s_own_class_cannot_travel(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from suave_des.managing.simple import NoManager

        monkeypatch.setattr(sys.modules["__main__"], "Mine", NoManager, raising=False)
        with pytest.raises(InputError, match="is defined in a script or a notebook, which workers do not have"):
            user_modules(["__main__:Mine"])


def test_files_that_managers_declare_travel_with_their_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "table.txt").write_text("fd_spiral_high")
    monkeypatch.chdir(tmp_path)
    settings = {f"{AWKWARD}:Declares": {"table": "table.txt"}}
    loaded = load_scenario("seams2023", manager_options=settings)
    declaring = replace(job(f"{AWKWARD}:Declares"), loaded=loaded)
    unpacked = Unpacked(pickle.loads(pickle.dumps(pack(declaring))), tmp_path / "there")
    (tmp_path / "table.txt").unlink()
    path = unpacked.job.loaded.manager_file(f"{AWKWARD}:Declares", "table.txt")
    assert path.is_relative_to(tmp_path / "there") and path.read_text() == "fd_spiral_high"


def test_errors_name_the_user_s_files(tmp_path: Path) -> None:
    files = [Path(name) for name in ("own/suave.owl", "tomasys.owl", "r.swrl")]
    own = job("none")
    own = replace(own, loaded=replace(own.loaded, ontologies=tuple(files[:2]), rules=tuple(files[2:])))
    parcel = Parcel(own, {str(path): b"<" for path in files}, {}, {})
    unpacked = Unpacked(parcel, tmp_path)
    suave, tomasys = unpacked.job.loaded.ontologies
    assert [path.name for path in (suave, tomasys, *unpacked.job.loaded.rules)] == [
        "suave.owl",
        "tomasys.owl",
        "r.swrl",
    ]
    error = KnowledgeError(f"supplies it, and so does {tomasys}", file=suave, place="line 2", remedy="give one")
    known = unpacked.error_with_known_names(error)
    assert type(known) is KnowledgeError
    assert str(known) == "own/suave.owl: line 2: supplies it, and so does tomasys.owl (give one)"
    failure: Finished = (MissionKey(0, 0, 1), MissionFailure("none", 1, 3.0, f"{suave}: broken"))
    assert unpacked.with_known_names(failure)[1] == MissionFailure("none", 1, 3.0, "own/suave.owl: broken")


class TestOnAWorker:
    @pytest.fixture(autouse=True)
    def worker(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
        pytest.importorskip("distributed")
        worker = SimpleNamespace(address="tcp://there:1", local_directory=str(tmp_path))
        monkeypatch.setattr("distributed.get_worker", lambda: worker)
        yield
        dask_worker.forget("token")
        assert list(tmp_path.iterdir()) == []  # nothing is left behind

    @staticmethod
    def run(parcel: Parcel, runs: range, **needs: str) -> list[Finished]:
        chunk = pickle.dumps([(0, 0, run) for run in runs])
        seconds, finished = pickle.loads(
            dask_worker.run("token", {**dask_worker.needs(), **needs}, pickle.dumps(parcel), chunk)
        )
        assert seconds > 0.0
        return list(finished)

    def test_the_same_rows_as_in_this_process(self) -> None:
        found = self.run(pack(job("random")), range(1, 6))
        assert found == list(MissionRunner(job("random")).each([MissionKey(0, 0, run) for run in range(1, 6)]))

    def test_a_mission_that_takes_too_long_is_interrupted_in_a_thread_too(self) -> None:
        outcomes: list[list[Finished]] = []
        parcel = pack(job(f"{AWKWARD}:HangsInSome", time_out_s=1.0))
        thread = threading.Thread(target=lambda: outcomes.append(self.run(parcel, range(1, 4))))
        thread.start()
        thread.join(60.0)
        (finished,) = outcomes
        assert [isinstance(outcome, MissionFailure) for _, outcome in finished] == [False, True, False]
        assert finished[1][1] == MissionFailure(
            f"{AWKWARD}:HangsInSome", 2, None, "not done after 1 s (time-out)", lasting=False
        )

    def test_a_machine_with_another_version_is_refused(self) -> None:
        with pytest.raises(InputError, match=r"numpy is [\d.]+ on worker tcp://there:1, and 1.0 here"):
            self.run(pack(job("none")), range(1, 2), numpy="1.0")

    def test_a_manager_with_other_code_is_refused(self) -> None:
        parcel = replace(pack(job("none")), manager_code={"none": "0" * 64})
        with pytest.raises(InputError, match="worker tcp://there:1: manager 'none' has different code there"):
            self.run(parcel, range(1, 2))
