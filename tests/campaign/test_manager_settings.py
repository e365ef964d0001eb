"""Settings and files of managers, on the command line and in sweeps; and whose code a resumed
campaign runs.
"""

import json
import linecache
import shutil
import sys
from pathlib import Path

import pytest

from suave_des import InputError, load_scenario, run_campaign, run_mission, with_values
from suave_des.campaign.inputs import read_campaign
from suave_des.campaign.spec import CampaignSpec, read_campaign_file
from suave_des.resources import shipped_folder
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

class Other(Settable):
    pass

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


def test_a_sweep_varies_a_managers_own_setting_which_the_scenario_need_not_have(settable):
    modes = ["fd_spiral_low", "fd_spiral_high"]
    frame = run_campaign(
        "seams2023", [settable], runs=3, sweep={f"managers.{settable}.mode": modes}
    )
    for mode in modes:
        rows = frame[frame[f"managers.{settable}.mode"] == mode]
        assert rows["search_time_s"].tolist() == search_times(managers=[f"fixed:{mode}"])


def test_values_by_key_path_are_those_of_the_scenario():
    assert (
        load_scenario(
            "seams2023", values={"mission.time_limit_s": 120}
        ).scenario.mission.time_limit_s
        == 120.0
    )
    by_sweeps_name = load_scenario("seams2023", values={"visibility.period_s": 40})
    assert by_sweeps_name.scenario.signals["water_visibility"].period_s == 40.0


def test_names_of_managers_may_have_points_in_key_paths():
    loaded = with_values(load_scenario("seams2023"), {"managers.package.module:Class.gain": 2.5})
    assert loaded.manager_settings("package.module:Class") == {"gain": 2.5}


def test_options_of_the_command_line(folder, settable):
    set_limit = ("--set", "mission.time_limit_s=150", "--set", "battery={discharge_time_s: 1e3}")
    chosen = (
        "--manager-option",
        "mode=fd_spiral_high",
        "--manager-option",
        f"{settable}.other=[1, x]",
    )
    done = command_here(
        "run", "seams2023", "--manager", settable, *set_limit, *chosen, "--out", "out", cwd=folder
    )
    assert done.returncode == 0, done.stderr
    scenario = json.loads((folder / "out" / "mission.json").read_text())["scenario"]
    assert (
        scenario["mission"]["time_limit_s"] == 150.0
        and scenario["battery"]["discharge_time_s"] == 1000.0
    )
    assert scenario["managers"][settable] == {"mode": "fd_spiral_high", "other": [1, "x"]}


class TestDeclaredFiles:
    @pytest.fixture
    def inputs(self, folder: Path, settable: str) -> set[str]:
        """Files of which a manifest has the SHA-256."""
        (folder / "table.txt").write_text("fd_spiral_high")
        options = {settable: {"table": "table.txt"}}
        run_campaign("seams2023", [settable], 1, out=folder / "out", manager_options=options)
        return set(json.loads((folder / "out" / "manifest.json").read_text())["inputs_sha256"])

    def test_they_are_hashed(self, inputs):
        assert "table.txt" in inputs

    def test_the_managers_code_is_hashed(self, inputs, settable):
        assert f"{settable.partition(':')[0]}.py" in inputs

    def test_they_are_found_beside_the_scenario_that_names_them(self, folder, settable):
        (folder / "below").mkdir()
        (folder / "below" / "table.txt").write_text("fd_spiral_high")
        scenario = f'base: seams2023\nmanagers: {{"{settable}": {{table: table.txt}}}}\n'
        (folder / "below" / "mine.yaml").write_text(scenario)
        found = run_mission(folder / "below" / "mine.yaml", settable, 1, 1).metrics.search_time_s
        assert found == run_mission("seams2023", "fixed:fd_spiral_high", 1, 1).metrics.search_time_s

    def test_a_missing_one_is_noticed_before_any_mission(self, folder, settable):
        with pytest.raises(InputError) as refused:
            run_campaign(
                "seams2023", [settable], 1, manager_options={settable: {"table": "table.txt"}}
            )
        assert "table.txt" in str(refused.value)

    def test_each_value_of_a_sweep_is_looked_at(self, folder, settable):
        (folder / "one.txt").write_text("fd_spiral_high")
        with pytest.raises(InputError, match=r"two\.txt"):
            run_campaign(
                "seams2023",
                [settable],
                1,
                sweep={f"managers.{settable}.table": ["one.txt", "two.txt"]},
            )

    def test_a_file_that_is_not_declared_is_not_given(self, folder, settable):
        with pytest.warns(UserWarning, match=r"secret\.txt' is not declared"):
            run_campaign("seams2023", [settable.replace("Settable", "Careless")], 1)

    @pytest.mark.parametrize("changed", ["a/table.txt", "a/table.yaml"])
    def test_a_change_of_one_is_noticed_when_the_campaign_is_resumed(
        self, folder, settable, changed
    ):
        """Also of a YAML file, and of one of two with the same name in different folders."""
        managers, files = (
            [settable, settable.replace("Settable", "Other")],
            [changed, changed.replace("a/", "b/")],
        )
        for name in files:
            (folder / name).parent.mkdir()
            (folder / name).write_text("fd_spiral_high")
        options = {manager: {"table": name} for manager, name in zip(managers, files, strict=True)}
        run_campaign("seams2023", managers, 1, out=folder / "out", manager_options=options)
        (folder / changed).write_text("fd_spiral_low")
        done = command_here(*RESUME, "--runs", "2", cwd=folder)
        assert done.returncode == 2 and f"files_sha256.{changed} was" in done.stderr


def as_received(out: Path) -> None:
    """Put a copy into the place of a folder, as if it came from elsewhere."""
    shutil.copytree(out, out.with_name("copy"))
    shutil.rmtree(out)
    out.with_name("copy").rename(out)


class TestReceivedFolder:
    @pytest.fixture
    def own(self, folder: Path, settable: str) -> Path:
        """A campaign whose module, which nothing has imported yet, notes that it is imported."""
        run_campaign("seams2023", ["none", settable], 1, out=folder / "out")
        name = settable.partition(":")[0]
        del sys.modules[name]
        linecache.clearcache()
        module = folder / f"{name}.py"
        module.write_text("import pathlib\npathlib.Path('imported').touch()\n" + SETTABLE)
        return folder

    @pytest.fixture
    def received(self, own: Path) -> Path:
        as_received(own / "out")
        return own

    def test_a_folder_that_this_user_began_here_asks_for_nothing(self, own):
        done = command_here(*RESUME, cwd=own)
        assert "or --yes" not in done.stderr and (own / "imported").exists()

    def test_from_another_folder_it_is_asked_for_again(self, own):
        """There, another module of the same name might be found."""
        (own / "below").mkdir()
        done = command_here("campaign", "--resume", "../out", cwd=own / "below")
        assert done.returncode == 2 and "or --yes" in done.stderr
        assert not (own / "below" / "imported").exists()

    def test_its_managers_are_not_imported_unasked(self, received, settable):
        done = command_here(*RESUME, cwd=received)
        assert done.returncode == 2 and f"the code of {settable}" in done.stderr
        assert not (received / "imported").exists()

    def test_a_manager_that_the_campaign_has_not_is_refused(self, received, settable):
        done = command_here(*RESUME, "--managers", settable[:-1], cwd=received)
        assert done.returncode == 2 and f"did you mean '{settable}'" in done.stderr
        assert not (received / "imported").exists()

    @pytest.mark.parametrize("is_named", [True, False])
    def test_they_are_when_the_user_says_so(self, received, settable, is_named):
        done = command_here(
            *RESUME, *(("--managers", settable) if is_named else ("--yes",)), cwd=received
        )
        assert (received / "imported").exists()
        # the code is another one than the campaign began with
        assert f"files_sha256.{settable.partition(':')[0]}.py was" in done.stderr

    def test_managers_of_the_campaign_file_are_not_run_unasked_either(self, folder):
        """The campaign file decides what runs, whatever the folder's own store says."""
        (folder / "mine.yaml").write_text(
            "campaign: 1\nscenario: seams2023\nmanagers: [none]\nruns: 1\n"
        )
        assert command_here("campaign", "mine.yaml", "--out", "out", cwd=folder).returncode == 0
        command = "exec:sh -c 'touch ran'"
        (folder / "mine.yaml").write_text(
            f'campaign: 1\nscenario: seams2023\nmanagers: ["{command}"]\nruns: 1\n'
        )
        done = command_here(*RESUME, cwd=folder)
        assert done.returncode == 2 and f"the code of {command}" in done.stderr
        assert not (folder / "ran").exists()


FUNCTION = """
f_lights:
  ros__parameters:
    type: system
    parts: f_lights_node
    modes: {fd_unground: {f_lights_node: inactive}, fd_dim: {f_lights_node: active.fd_dim}}
f_lights_node:
  ros__parameters: {type: node, modes: {fd_dim: {ros__parameters: {power_w: 15.0}}}}
"""
LIGHTS = (
    "from suave_des.managed.node import CustomFunction\nclass Lights(CustomFunction):\n    pass\n"
)


class TestReceivedFunction:
    """A scenario names the class of a function of the user's."""

    @pytest.fixture
    def received(self, folder: Path) -> Path:
        """A campaign whose module, which nothing has imported yet, notes that it is imported."""
        modes = (shipped_folder("scenarios") / "suave_modes.yaml").read_text()
        (folder / "modes.yaml").write_text(modes + FUNCTION)
        module = folder / f"lights_{folder.name}.py"
        module.write_text("import pathlib\npathlib.Path('imported').touch()\n" + LIGHTS)
        text = "base: seams2023\nmodes_file: modes.yaml\nmission: {functions: {search_pipeline: [f_lights]}}\n"
        text += f"default_modes: {{f_lights: fd_dim}}\nfunctions: {{f_lights: {{node: '{module.stem}:Lights'}}}}\n"
        (folder / "mine.yaml").write_text(text)
        made = command_here(
            "campaign", "mine.yaml", "--managers", "none", "--runs", "1", "--out", "out", cwd=folder
        )
        assert made.returncode == 0, made.stderr
        as_received(folder / "out")
        (folder / "imported").unlink()
        return folder

    @pytest.mark.parametrize("command", [RESUME, ("replay", "out")])
    def test_it_is_not_imported_unasked(self, received, command):
        done = command_here(*command, cwd=received)
        assert (
            done.returncode == 2 and f"run the code of lights_{received.name}:Lights" in done.stderr
        )
        assert not (received / "imported").exists()
        assert command_here(*command, "--yes", cwd=received).returncode == 0
        assert (received / "imported").exists()

    def test_a_report_imports_nothing(self, received):
        pytest.importorskip("plotly")
        assert command_here("report", "out", cwd=received).returncode == 0
        assert not (received / "imported").exists()

    def test_a_class_that_a_sweep_names_is_not_imported_unasked_either(self, received):
        name = f"lights_{received.name}:Lights"
        text = f'campaign: 1\nscenario: mine.yaml\nmanagers: [none]\nsweep: {{functions.f_lights.node: ["{name}"]}}\n'
        (received / "swept.yaml").write_text(text)
        (received / "mine.yaml").write_text(
            (received / "mine.yaml").read_text().replace(name, "installed_package")
        )
        file = read_campaign_file(received / "swept.yaml")
        campaign = read_campaign(CampaignSpec.of(received / "swept.yaml"), file)
        assert campaign.code() == (name,)
        assert not (received / "imported").exists()
