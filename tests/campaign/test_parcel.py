"""What travels to workers of a cluster, and what these do with it; without a cluster."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

import pytest

from suave_des.campaign import dask_worker
from suave_des.campaign.dask_worker import Order, Report
from suave_des.campaign.mission_process import Trouble
from suave_des.campaign.missions import MissionRunner
from suave_des.campaign.outcomes import Failure, Finished, Job
from suave_des.campaign.own_modules import own_modules
from suave_des.campaign.parcel import Parcel, pack, unpack
from suave_des.campaign.plan import MissionKey
from suave_des.campaign.variation import Variation, vary
from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.inference_cache import InferenceCache
from suave_des.scenario.loader import load_scenario
from tests.helpers import AWKWARD


def job(*managers: str, time_out_s: float = 60.0) -> Job:
    return Job(load_scenario("seams2023"), Variation(), managers, 1, time_out_s)


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
        found = own_modules(["mine.manager:M", "none", "metacontrol"])
        assert found == {place: folder / place for place in files if place != "mine/not_imported.py"}

    def test_a_class_from_another_module_brings_both(self, folder: Path) -> None:
        (folder / "facade.py").write_text("from behind import M\n")
        (folder / "behind.py").write_text(
            "from suave_des.managing.simple import NoManager\nclass M(NoManager):\n    pass\n"
        )
        assert set(own_modules(["facade:M"])) == {"facade.py", "behind.py"}

    def test_a_script_s_own_class_cannot_travel(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from suave_des.managing.simple import NoManager

        monkeypatch.setattr(sys.modules["__main__"], "Mine", NoManager, raising=False)
        with pytest.raises(InputError, match="is defined in a script or a notebook, which workers do not have"):
            own_modules(["__main__:Mine"])


def test_errors_name_the_user_s_files(tmp_path: Path) -> None:
    parcel = Parcel(job("none"), (("own/suave.owl", b"<"), ("tomasys.owl", b"<")), (("r.swrl", b""),), {}, {}, {})
    unpacked = unpack(parcel, tmp_path)
    suave, tomasys = unpacked.job.loaded.ontologies
    assert [path.name for path in (suave, tomasys, *unpacked.job.loaded.rules)] == [
        "suave.owl",
        "tomasys.owl",
        "r.swrl",
    ]
    error = KnowledgeError(f"supplies it, and so does {tomasys}", file=suave, place="line 2", remedy="give one")
    known = unpacked.error_as_known(error)
    assert type(known) is KnowledgeError
    assert str(known) == "own/suave.owl: line 2: supplies it, and so does tomasys.owl (give one)"
    failure: Finished = (MissionKey(0, 0, 1), Failure("none", 1, 3.0, f"{suave}: broken"))
    assert unpacked.as_known([failure])[0][1] == Failure("none", 1, 3.0, "own/suave.owl: broken")


def test_of_a_sweep_that_changes_knowledge_all_memories_travel(tmp_path: Path) -> None:
    path = tmp_path / "values.yaml"
    path.write_text("base: seams2023.yaml\nknowledge: {values: {qa_water_visibility_low: 1.0}}\n")
    swept = {
        "knowledge.values.qa_water_visibility_low": [1.0, 1.25],
        "knowledge.reasoner": ["remembered", "pellet"],
        "visibility.period_s": [40, 80, 160],
    }
    loaded, variation = vary(load_scenario(path), swept, {}, 1, 1)
    parcel = pack(Job(loaded, variation, ("metacontrol",), 1, 60.0))
    assert len(parcel.memories) == 2
    assert pack(Job(loaded, variation, ("random",), 1, 60.0)).memories == {}


class TestOnAWorker:
    @staticmethod
    def run(job: Job, runs: range, folder: Path, token: str = "a") -> tuple[dict[MissionKey, object], Report]:
        order = Order(token, dask_worker.needs(), pickle.dumps(pack(job)), job.time_out_s)
        try:
            report = dask_worker.run(order, [(0, 0, run) for run in runs], str(folder))
        finally:
            dask_worker.forget(token)
        assert isinstance(report, Report), report
        assert list(folder.iterdir()) == []  # nothing is left behind
        return dict(finished for part in report.parts for finished in pickle.loads(part)), report

    def test_the_same_rows_as_in_this_process(self, tmp_path: Path) -> None:
        found, report = self.run(job("random"), range(1, 6), tmp_path, "same")
        assert found == dict(MissionRunner(job("random")).each(iter([MissionKey(0, 0, run) for run in range(1, 6)])))
        assert (report.missions, report.lost) == (5, [])

    def test_a_mission_that_hears_no_alarm_is_ended_from_outside(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(dask_worker, "_MARGIN_S", 0.5)
        found, report = self.run(job(f"{AWKWARD}:BlocksInSome", time_out_s=3.0), range(2, 3), tmp_path, "blocks")
        assert (found, report.lost) == ({}, [((0, 0, 2), None)])

    def test_what_reasoners_learn_comes_home(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path / "cache"))
        (tmp_path / "scratch").mkdir()
        first, report = self.run(job("metacontrol"), range(1, 2), tmp_path / "scratch", "learns")
        ((digest, entries),) = (item for learned in report.learned for item in learned.items())
        InferenceCache(digest).take_over(entries)
        assert pack(job("metacontrol")).memories == {digest: InferenceCache(digest).content()}
        monkeypatch.setenv("JAVA_HOME", str(tmp_path / "no_java"))
        again, report = self.run(job("metacontrol"), range(1, 2), tmp_path / "scratch", "knows")
        assert again == first
        assert report.learned == [{}]

    def test_a_machine_with_another_version_says_what_it_has(self, tmp_path: Path) -> None:
        order = Order("other", {**dask_worker.needs(), "suave-des": "99"}, b"", 1.0)
        assert dask_worker.run(order, [(0, 0, 1)], str(tmp_path)) == dask_worker.needs()

    def test_a_manager_with_other_code_is_refused(self, tmp_path: Path) -> None:
        parcel = pack(job("none"))
        order = Order("code", dask_worker.needs(), pickle.dumps(_with_other_code(parcel)), 1.0)
        trouble = dask_worker.run(order, [(0, 0, 1)], str(tmp_path))
        dask_worker.forget("code")
        assert isinstance(trouble, Trouble)
        assert trouble.error is not None
        assert str(pickle.loads(trouble.error)).startswith("manager 'none' has other code there than here")

    def test_a_chunk_that_comes_after_the_campaign_is_over_is_left(self, tmp_path: Path) -> None:
        dask_worker.forget("late")
        assert dask_worker.run(Order("late", dask_worker.needs(), b"", 1.0), [(0, 0, 1)], str(tmp_path)) == Report()


def _with_other_code(parcel: Parcel) -> Parcel:
    return Parcel(parcel.job, parcel.ontologies, parcel.rules, parcel.modules, {"none": "0" * 64}, parcel.memories)
