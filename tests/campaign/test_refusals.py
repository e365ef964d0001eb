"""What campaigns and the Python API refuse: what is given, and what is said.

The words stand here alone; what else a refusal does or leaves is tested where it belongs.
"""

from collections.abc import Callable
from pathlib import Path

import pytest

import suave_des
from suave_des import load_scenario, run_campaign, run_mission, with_values
from suave_des.campaign.campaign import train
from suave_des.errors import InputError
from suave_des.learned import Learned, read_file
from suave_des.managing.simple import NoManager
from suave_des.registry import name_of
from tests.helpers.command import command_here


class Picky(NoManager):
    """Has a check that raises."""

    @classmethod
    def check(cls, loaded: object) -> None:
        return loaded.no_such  # type: ignore[attr-defined, no-any-return]


def local_class() -> type[NoManager]:
    class Inner(NoManager):
        """Cannot be imported."""

    return Inner


def read_text(text: str) -> Learned:
    Path("policy.json").write_text(text)
    return read_file(Path("policy.json"))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: run_mission("seams2023", mananger="none"),
            "run_mission has no argument 'mananger' .did you mean",
        ),
        (lambda: run_mission(), "run_mission: missing a required argument: 'scenario'"),
        (
            lambda: run_mission(3),
            "scenario: expected a name, a path or a loaded scenario, got 3",
        ),
        (
            lambda: run_mission("seams2023", "none", run="1"),
            "run: expected a whole number, got '1'",
        ),
        (
            lambda: run_campaign("seams2023", runs="ten"),
            "runs: expected a whole number, got 'ten'",
        ),
        (lambda: run_campaign("seams2023", rnus=3), "no argument 'rnus' .did you mean 'runs'"),
        (lambda: run_campaign("seams2023", command=["x"]), "no argument 'command'"),
        (
            lambda: load_scenario("seams2023", rules="a.swrl"),
            "rules: expected a list, got 'a.swrl'",
        ),
        (
            lambda: with_values("seams2023", {}),
            "loaded: expected a loaded scenario, got 'seams2023'",
        ),
        (
            lambda: suave_des.Mission("seams2023", sed=3),
            "Mission has no argument 'sed' .did you mean 'seed'",
        ),
        (
            lambda: suave_des.KnowledgeBase.load(rulez="x"),
            "KnowledgeBase.load has no argument 'rulez'",
        ),
        (
            lambda: suave_des.CampaignFrame().compare(metrcs=["x"]),
            "compare has no argument 'metrcs' .did ",
        ),
        (
            lambda: run_mission("seams2023", "none").figure("mapp"),
            "there is no figure 'mapp' of a mission .did you mean 'map'",
        ),
        *((lambda wrong=wrong: name_of(wrong), "expected a manager") for wrong in (int, 3, None)),
        (
            lambda: name_of(local_class()),
            "top level of a module, script or notebook cell",
        ),
        (
            lambda: run_mission(load_scenario("seams2023"), "none", rules=["mine.swrl"]),
            "give rules to load_scenario",
        ),
        (
            lambda: load_scenario("seams2023", values={"mission.time_limit": 120}),
            r"--set: mission\.time_limit: unknown key",
        ),
        (
            lambda: run_campaign("seams2023", [Picky], runs=1),
            r"manager .*:Picky: check raised AttributeError: .*no_such",
        ),
        (lambda: train("seams2023", "none", 1, Path("policy.json")), "has learned nothing"),
        (lambda: Learned("mine", "seams2023", 1, 1, {}, {1: 2.0}).text(), "cannot be written"),
        (lambda: read_text("{}"), "is not a file that suave-des train has written"),
    ],
)
def test_of_a_call(call: Callable[[], object], words: str, in_a_folder: Path) -> None:
    with pytest.raises(InputError, match=words):
        call()


@pytest.fixture
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--set", "mission"), "--set: 'mission' is not KEY=VALUE"),
        (("--set", "mission.time_limit_s=soon"), "time_limit_s"),
        (("--set", "mission.time_limit_s={"), "is not YAML"),
        (("--set", "misson.time_limit_s=3"), "did you mean 'mission'"),
        (("--set", "visiblity.period_s=40"), "did you mean 'visibility'"),
        (("--manager-option", "=3"), "is not KEY=VALUE"),
        (("--manager-option", "other:Manager.mode=x"), "is for none of the managers"),
    ],
)
def test_of_options(tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    done = command_here("run", "seams2023", "--manager", "none", *options, cwd=tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert words in done.stderr


HEAD = "campaign: 1\nscenario: seams2023\nmanagers: [none, random]\nruns: 4\nseed: 7\n"
UNIFORM = "{distribution: uniform, minimum: %s, maximum: %s}"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("campaign: 2\nscenario: seams2023\n", "line 1, campaign: "),
        ("campaign: 1\n", "scenario: is missing"),
        (HEAD + "sweeps: {}\n", "line 6, sweeps: unknown key 'sweeps' (did you mean 'sweep'?"),
        (HEAD + "sweep:\n  visibility.perod_s: [40]\n", "line 7, sweep.visibility.perod_s: "),
        (
            HEAD + "sweep:\n  visibility.period_s: 40\n",
            "line 7, sweep.visibility.period_s: 40 should be a list",
        ),
        (
            HEAD + "sweep:\n  visibility.period_s: [40, -3]\n",
            "line 7, sweep.visibility.period_s: at",
        ),
        (
            HEAD + "sweep:\n  visibility.period_s: [40, 3, 40.0]\n",
            "line 7, sweep.visibility.period_s: has a poi",
        ),
        (HEAD + "sweep:\n  zip: {start.x_m: [1, 1], start.y_m: [2, 2.0]}\n", "has a point twice"),
        (HEAD + "sweep:\n  modes_file: [a.yaml]\n", "files were read with the scenario"),
        (HEAD + "sweep:\n  grid: {}\n  start.x_m: [1]\n", "line 8, sweep.start.x_m: unknown key"),
        (
            HEAD + "sweep:\n  zip: {start.x_m: [1], start.y_m: [1, 2]}\n",
            "start.x_m has 1, start.y_m has 2",
        ),
        (
            HEAD + "perturbations:\n  start.x_m: 3\n",
            "line 7, perturbations.start.x_m: expected a distribution, got 3",
        ),
        (
            HEAD + f"perturbations:\n  latencies.mode_change_s: {UNIFORM % (1, 2)}\n",
            "is drawn at each use, not once",
        ),
        (
            HEAD + f"perturbations:\n  mission.time_limit_s: {UNIFORM % (1, 2)}\n",
            "line 7, perturbations.mission.ti",
        ),
        (
            HEAD + f"perturbations:\n  start.x_m: {UNIFORM % (1, 2)}\nsweep:\n  start.x_m: [1]\n",
            "varies start.x_m, as",
        ),
        (
            HEAD + "sweep:\n  metacontrol.reasoning_period_s: [1, 2]\n",
            "did you mean managers.metacontrol or",
        ),
    ],
)
def test_of_a_campaign_file(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "campaign.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        run_campaign(path, out=tmp_path / "out")
    assert words in str(refused.value)
    assert refused.value.file == str(path)
    assert not (tmp_path / "out").exists()


GAIN = "calibration.velocity_gain_per_s"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "line 1: has no column for each parameter"),
        (f"{GAIN}\n0.6\n", "line 1: has 1 member "),
        (f"{GAIN},{GAIN}\n1,1\n1,1\n", "line 1: has no column for each parameter"),
        (f"{GAIN}\n0.6\nfast\n", "line 3: expected 1 numbers, got fast"),
        (f"{GAIN}\n0.6\n0.6,0.7\n", "line 3: expected 1 numbers, got 0.6, 0.7"),
        (
            f"{GAIN}\n0.6\n-4\n",
            "member 2 does not fit scenario seams2023: at calibration.velocity_gain_per_s=-4.0: ",
        ),
        ("calibration.gain\n1\n2\n", "calibration.gain: "),
        ("revision\n1\n2\n", "member 1 does not fit scenario seams2023: "),
    ],
)
def test_of_an_ensemble(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "two.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        run_campaign("seams2023", ["none"], 1, ensemble=path)
    assert words in str(refused.value)
    assert "two.csv" in str(refused.value)


@pytest.mark.parametrize(
    ("body", "status", "words"),
    [
        (
            "def __init__(self, system): self.mine = system",
            3,
            "__init__ does not begin with super().__init__(system)",
        ),
        ("def diagnostic(self, kind, value): pass", 2, "write def diagnostic(self, diagnostic)"),
        ("def task_request(self, task): pass", 2, "did you mean def task_requested(self, task)?"),
        ("adapt = 3", 2, "write def adapt(self)"),
        ("period_s = 1.0; adapt = endless", 3, "no mission time passed"),
        (
            "def diagnostic(self, diagnostic): yield self.system.env.timeout(1.0)",
            2,
            "only adapt may yield",
        ),
        ("async def task_requested(self, task): pass", 2, "write def task_requested(self, task)"),
        (
            "period_s = 1.0; adapt = lambda self: 'fd_spiral_low'",
            3,
            "adapt returned 'fd_spiral_low'; it may",
        ),
        (
            "period_s = '2'; adapt = endless",
            3,
            "period_s is '2', starts_s is 0.0; they must be numbers",
        ),
        ("period_s = 1.0; starts_s = -50.0; adapt = endless", 3, "starts_s is -50.0"),
        (
            "period_s = 1.0; adapt = endless; depends_on = ['water_visibility']",
            3,
            "depends_on is ['water_visi",
        ),
        (
            "depends_on = {'water_visiblity': (3.25,)}",
            3,
            "depends_on is {'water_visiblity': (3.25,)}; it must be like",
        ),
        ("subscribes_to = ('visibility',)", 2, "subscribes_to is ('visibility',)"),
        ("def check(self, loaded): pass", 2, "write @classmethod def check(cls, loaded)"),
        (
            "input_files = classmethod(lambda cls, settings: [settings['table']])",
            2,
            "--manager-option NAME=VALUE",
        ),
    ],
)
def test_of_a_class(tmp_path: Path, body: str, status: int, words: str) -> None:
    endless = "def endless(self):\n    while True:\n        yield self.system.env.timeout(0.0)\n"
    text = f"from suave_des.managing.base import ManagingSubsystem\n{endless}class M(ManagingSubsystem):\n    {body}\n"
    (tmp_path / "mistakes.py").write_text(text)
    done = command_here("run", "seams2023", "--manager", "mistakes:M", cwd=tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (status, 1)
    assert words in done.stderr
