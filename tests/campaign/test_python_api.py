"""What `suave_des` offers to scripts and notebooks."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

import suave_des
from suave_des.campaign.campaign import CampaignInterrupted
from suave_des.errors import InputError
from suave_des.records.store import Store
from tests.helpers import AWKWARD


@pytest.fixture
def interrupted_after(monkeypatch: pytest.MonkeyPatch):
    """Makes Ctrl-C come when so many missions are kept."""

    def after(missions: int) -> None:
        real = Store.append

        def append(store: Store, finished: object) -> None:
            real(store, finished)  # type: ignore[arg-type]
            if store.count() == missions:
                raise KeyboardInterrupt

        monkeypatch.setattr(Store, "append", append)

    return after


def test_names_are_there_and_importing_the_package_imports_nothing_else() -> None:
    code = (
        "import sys, suave_des\n"
        "loaded = [name for name in sys.modules if name.startswith('suave_des.')]\n"
        "heavy = {'numpy', 'pandas', 'rich', 'simpy', 'jpype'} & set(sys.modules)\n"
        "missing = set(suave_des.__all__) - set(dir(suave_des))\n"
        "print(loaded, heavy or '', missing or '')"
    )
    root = Path(suave_des.__file__).parents[1]
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=root)
    assert ended.stdout.split() == ["[]"]


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'suave_des' has no attribute 'run_campain'"):
        _ = suave_des.run_campain  # type: ignore[attr-defined]


class TestRunCampaign:
    def test_a_row_is_a_mission_and_every_column_has_a_type(self) -> None:
        frame = suave_des.run_campaign("seams2023", ["random", "none"], runs=3, seed=1)
        assert list(frame["manager"]) == ["random"] * 3 + ["none"] * 3
        assert list(frame["manager"].cat.categories) == ["random", "none"]
        kinds = {str(kind) for name, kind in frame.dtypes.items() if name.endswith(("_s", "_m"))}
        assert kinds == {"float64"}
        names = ("scenario", "run", "seed", "pipeline_found", "adaptations")
        assert [str(frame[name].dtype) for name in names] == ["category", "int64", "int64", "bool", "int64"]
        assert frame["mean_reaction_time_s"].isna().any()

    def test_it_is_what_runs_csv_says(self, scenario: Path, tmp_path: Path) -> None:
        frame = suave_des.run_campaign(scenario, ["none"], 4, 1, out=tmp_path / "out")
        read = pandas.read_csv(tmp_path / "out" / "runs.csv")
        pandas.testing.assert_frame_equal(frame, read, check_dtype=False, check_categorical=False)

    def test_attrs_tell_the_rest_as_plain_values(self, tmp_path: Path) -> None:
        with pytest.warns(
            UserWarning, match=rf"\d of 6 missions failed, see attrs\['failures'\]: manager {AWKWARD}:"
        ) as told:
            frame = suave_des.run_campaign(
                "seams2023",
                [f"{AWKWARD}:RaisesInHalf"],
                runs=3,
                out=tmp_path / "out",
                sweep={"visibility.period_s": [40, 80]},
            )
        assert Path(told[0].filename).name == Path(__file__).name
        manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
        for name in ("missions", "failures"):
            assert frame.attrs[name] == manifest[name]
        assert frame.attrs["missions"]["done"] == len(frame)
        with (tmp_path / "out" / "summary.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        assert [list(row) for row in rows] == [list(told) for told in frame.attrs["summary"]]
        assert [row["n"] for row in rows] == [str(told["n"]) for told in frame.attrs["summary"]]
        assert (frame.attrs["folder"], frame.attrs["interrupted"]) == (str(tmp_path / "out"), False)
        json.dumps(frame.attrs)  # or pandas could not keep them in a Parquet file
        pandas.concat([frame, frame])

    def test_defaults_are_those_of_the_command_line(self, scenario: Path) -> None:
        frame = suave_des.run_campaign(scenario)
        assert frame.groupby("manager", observed=True).size().to_dict() == {"none": 20, "random": 20, "metacontrol": 20}

    def test_without_any_row_the_types_are_the_same(self, scenario: Path) -> None:
        with pytest.warns(UserWarning, match="1 of 1 missions failed"):
            nothing = suave_des.run_campaign(scenario, [f"{AWKWARD}:RaisesAlways"], 1)
        some = suave_des.run_campaign(scenario, ["none"], 1)
        assert len(nothing) == 0
        assert [str(kind) for kind in nothing.dtypes] == [str(kind) for kind in some.dtypes]

    def test_ctrl_c_at_a_prompt_gives_what_is_there(
        self, scenario: Path, tmp_path: Path, interrupted_after, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(sys, "ps1", ">>> ", raising=False)
        for out in (None, tmp_path / "out"):
            interrupted_after(7)
            with pytest.warns(UserWarning, match="interrupted; 7 of 20 missions are done"):
                frame = suave_des.run_campaign(scenario, ["none"], 20, 1, out=out)
            assert (len(frame), frame.attrs["interrupted"]) == (7, True)
            monkeypatch.undo()
            monkeypatch.setattr(sys, "ps1", ">>> ", raising=False)
        assert len(suave_des.resume_campaign(tmp_path / "out")) == 20

    def test_ctrl_c_in_a_script_stops_the_script(self, scenario: Path, interrupted_after) -> None:
        interrupted_after(7)
        with pytest.raises(CampaignInterrupted) as stopped:
            suave_des.run_campaign(scenario, ["none"], 20, 1)
        assert len(stopped.value.result.frame()) == 7

    def test_progress_is_shown_when_asked_for(
        self, scenario: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("suave_des.campaign.progress._FIRST_LINE_S", 0.0)
        suave_des.run_campaign(scenario, ["none"], 3)
        assert capsys.readouterr().err == ""
        suave_des.run_campaign(scenario, ["none"], 3, progress=True)
        assert "3 of 3 missions" in capsys.readouterr().err


class TestArguments:
    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (
                lambda: suave_des.run_mission("seams2023", mananger="none"),
                "run_mission has no argument 'mananger' .did ",
            ),
            (lambda: suave_des.run_mission(), "run_mission: missing a required argument: 'scenario'"),
            (lambda: suave_des.run_mission(3), "scenario: expected a name, a path or a loaded scenario, got 3"),
            (lambda: suave_des.run_mission("seams2023", "none", run="1"), "run: expected a whole number, got '1'"),
            (lambda: suave_des.run_campaign("seams2023", rnus=3), "no argument 'rnus' .did you mean 'runs'"),
            (lambda: suave_des.run_campaign("seams2023", command=["x"]), "no argument 'command'"),
            (lambda: suave_des.load_scenario("seams2023", rules="a.swrl"), "rules: expected a list, got 'a.swrl'"),
            (lambda: suave_des.with_values("seams2023", {}), "loaded: expected a loaded scenario, got 'seams2023'"),
            (lambda: suave_des.Mission("seams2023", sed=3), "Mission has no argument 'sed' .did you mean 'seed'"),
            (lambda: suave_des.KnowledgeBase.load(rulez="x"), "KnowledgeBase.load has no argument 'rulez'"),
            (lambda: suave_des.CampaignFrame().compare(metrcs=["x"]), "compare has no argument 'metrcs' .did "),
        ],
    )
    def test_that_a_function_has_not_or_of_another_type_are_told_in_plain_words(self, call, words: str) -> None:
        with pytest.raises(InputError, match=words):
            call()

    def test_numbers_may_be_of_numpy(self, scenario: Path) -> None:
        assert len(suave_des.run_campaign(scenario, "none", runs=np.int64(2), seed=np.uint8(3))) == 2


class TestFigures:
    @pytest.mark.parametrize(("kind", "panels"), [("map", 3), ("timeline", 3)])
    def test_a_mission_draws_itself(self, kind: str, panels: int) -> None:
        mission = suave_des.run_mission("seams2023", "none", run=1, seed=8)
        assert len(mission.figure(kind).axes) == panels

    def test_a_figure_that_there_is_not_is_refused(self) -> None:
        mission = suave_des.run_mission("seams2023", "none", values={"mission.time_limit_s": 20})
        with pytest.raises(InputError, match=r"there is no figure 'mapp' of a mission .did you mean 'map'"):
            mission.figure("mapp")
