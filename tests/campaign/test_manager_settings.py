"""Settings and files of managers, on the command line and in sweeps; and whose code a resumed campaign runs."""

import json
import linecache
import sys
from pathlib import Path

import pytest

from suave_des import InputError, load_scenario, run_campaign, run_mission, with_values
from tests.helpers.command import command_here

RESUME = ("campaign", "--resume", "out", "--workers", "1")
SETTABLE = """
from suave_des.managing.simple import NoManager

class Settable(NoManager):
    def task_requested(self, task):
        super().task_requested(task)
        mode = self.system.settings.get("mode")
        if "table" in self.system.settings:
            mode = self.system.file(self.system.settings["table"]).read_text().strip()
        if mode and "f_generate_search_path" in task.functions:
            self.system.change_mode("f_generate_search_path", mode)

    @classmethod
    def input_files(cls, settings):
        return [settings["table"]] if "table" in settings else []

class Careless(NoManager):
    def mission_started(self):
        self.system.file("secret.txt")
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a module of managers whose name no other test has."""
    (tmp_path / f"settable_{tmp_path.name}.py").write_text(SETTABLE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


@pytest.fixture
def settable(folder: Path) -> str:
    return f"settable_{folder.name}:Settable"


def search_times(**options: object) -> list[float]:
    return run_campaign("seams2023", runs=3, **options)["search_time_s"].tolist()  # type: ignore[arg-type]


def test_a_managers_options_reach_it(settable: str) -> None:
    found = search_times(managers=[settable], manager_options={settable: {"mode": "fd_spiral_high"}})
    assert found == search_times(managers=["fixed:fd_spiral_high"])


def test_a_sweep_varies_a_managers_own_setting_which_the_scenario_need_not_have(settable: str) -> None:
    modes = ["fd_spiral_low", "fd_spiral_high"]
    frame = run_campaign("seams2023", [settable], runs=3, sweep={f"managers.{settable}.mode": modes})
    for mode in modes:
        rows = frame[frame[f"managers.{settable}.mode"] == mode]
        assert rows["search_time_s"].tolist() == search_times(managers=[f"fixed:{mode}"])


def test_values_by_key_path_are_those_of_the_scenario() -> None:
    assert load_scenario("seams2023", values={"mission.time_limit_s": 120}).scenario.mission.time_limit_s == 120.0
    with pytest.raises(InputError, match=r"--set: mission\.time_limit: unknown key"):
        load_scenario("seams2023", values={"mission.time_limit": 120})


def test_names_of_managers_may_have_points_in_key_paths() -> None:
    loaded = with_values(load_scenario("seams2023"), {"managers.package.module:Class.gain": 2.5})
    assert loaded.manager_settings("package.module:Class") == {"gain": 2.5}


def test_options_of_the_command_line(folder: Path, settable: str) -> None:
    set_limit = ("--set", "mission.time_limit_s=150", "--set", "battery={discharge_time_s: 1e3}")
    chosen = ("--manager-option", "mode=fd_spiral_high", "--manager-option", f"{settable}.other=[1, x]")
    done = command_here("run", "seams2023", "--manager", settable, *set_limit, *chosen, "--out", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    scenario = json.loads((folder / "out" / "mission.json").read_text())["scenario"]
    assert scenario["mission"]["time_limit_s"] == 150.0 and scenario["battery"]["discharge_time_s"] == 1000.0
    assert scenario["managers"][settable] == {"mode": "fd_spiral_high", "other": [1, "x"]}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--set", "mission"), "--set: 'mission' is not KEY=VALUE"),
        (("--set", "mission.time_limit_s=soon"), "time_limit_s"),
        (("--set", "mission.time_limit_s={"), "is not YAML"),
        (("--set", "misson.time_limit_s=3"), "did you mean 'mission'"),
        (("--manager-option", "=3"), "is not KEY=VALUE"),
        (("--manager-option", "other:Manager.mode=x"), "is for none of the managers"),
    ],
)
def test_options_that_make_no_sense_are_bad_input(tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    done = command_here("run", "seams2023", "--manager", "none", *options, cwd=tmp_path)
    assert done.returncode == 2 and words in done.stderr and "Traceback" not in done.stderr


class TestDeclaredFiles:
    def test_they_and_the_managers_code_are_hashed(self, folder: Path, settable: str) -> None:
        (folder / "table.txt").write_text("fd_spiral_high")
        options = {settable: {"table": "table.txt"}}
        run_campaign("seams2023", [settable], 1, out=folder / "out", manager_options=options)
        inputs = json.loads((folder / "out" / "manifest.json").read_text())["inputs_sha256"]
        assert {"table.txt", f"{settable.partition(':')[0]}.py"} <= inputs.keys()

    def test_they_are_found_beside_the_scenario_that_names_them(self, folder: Path, settable: str) -> None:
        (folder / "below").mkdir()
        (folder / "below" / "table.txt").write_text("fd_spiral_high")
        scenario = f'base: seams2023\nmanagers: {{"{settable}": {{table: table.txt}}}}\n'
        (folder / "below" / "mine.yaml").write_text(scenario)
        found = run_mission(folder / "below" / "mine.yaml", settable, 1, 1).metrics.search_time_s
        assert found == run_mission("seams2023", "fixed:fd_spiral_high", 1, 1).metrics.search_time_s

    def test_a_missing_one_is_noticed_before_any_mission(self, folder: Path, settable: str) -> None:
        with pytest.raises(InputError, match=r"table\.txt.*reads this file, and it is not there"):
            run_campaign("seams2023", [settable], 1, manager_options={settable: {"table": "table.txt"}})

    def test_each_value_of_a_sweep_is_looked_at(self, folder: Path, settable: str) -> None:
        (folder / "one.txt").write_text("fd_spiral_high")
        with pytest.raises(InputError, match=r"two\.txt"):
            run_campaign("seams2023", [settable], 1, sweep={f"managers.{settable}.table": ["one.txt", "two.txt"]})

    def test_a_file_that_is_not_declared_is_not_given(self, folder: Path, settable: str) -> None:
        with pytest.warns(UserWarning, match=r"secret\.txt' is not declared"):
            run_campaign("seams2023", [settable.replace("Settable", "Careless")], 1)

    def test_a_change_is_noticed_when_the_campaign_is_resumed(self, folder: Path, settable: str) -> None:
        (folder / "table.txt").write_text("fd_spiral_high")
        run_campaign("seams2023", [settable], 1, out=folder / "out", manager_options={settable: {"table": "table.txt"}})
        (folder / "table.txt").write_text("fd_spiral_low")
        done = command_here(*RESUME, "--managers", settable, "--runs", "2", cwd=folder)
        assert done.returncode == 2 and "files_sha256.table.txt was" in done.stderr


def test_a_check_that_raises_is_bad_input(folder: Path) -> None:
    text = "\nclass Picky(NoManager):\n    @classmethod\n    def check(cls, loaded):\n        return loaded.no_such\n"
    with (folder / f"settable_{folder.name}.py").open("a") as module:
        module.write(text)
    name = f"settable_{folder.name}:Picky"
    with pytest.raises(InputError, match=f"manager {name}: check raised AttributeError: .*no_such"):
        run_campaign("seams2023", [name], runs=1)


class TestReceivedFolder:
    @pytest.fixture
    def received(self, folder: Path, settable: str) -> Path:
        """A campaign whose module, which nothing has imported yet, notes that it is imported."""
        run_campaign("seams2023", ["none", settable], 1, out=folder / "out")
        name = settable.partition(":")[0]
        del sys.modules[name]
        linecache.clearcache()
        module = folder / f"{name}.py"
        module.write_text("import pathlib\npathlib.Path('imported').touch()\n" + SETTABLE)
        return folder

    def test_its_managers_are_not_imported_unasked(self, received: Path, settable: str) -> None:
        done = command_here(*RESUME, cwd=received)
        assert done.returncode == 2 and f"give --managers {settable}" in done.stderr
        assert not (received / "imported").exists()

    @pytest.mark.parametrize("how", ["named", "confirmed"])
    def test_they_are_when_the_user_says_so(self, received: Path, settable: str, how: str) -> None:
        options = ("--managers", settable) if how == "named" else ("--yes",)
        done = command_here(*RESUME, *options, cwd=received)
        assert (received / "imported").exists()
        assert "manager_code_sha256" in done.stderr  # the code is another one than the campaign began with

    def test_a_manager_that_it_does_not_have_cannot_be_added_but_compared(self, received: Path) -> None:
        done = command_here(*RESUME, "--managers", "bt", cwd=received)
        assert done.returncode == 2 and "the campaign has no manager 'bt'" in done.stderr
        assert "with the same seed into another folder: suave-des compare out FOLDER pairs" in done.stderr
