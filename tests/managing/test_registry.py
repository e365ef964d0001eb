"""Managers by name."""

import sys
import threading
import time
from pathlib import Path

import pytest

from suave_des import run_mission
from suave_des.errors import InputError, MissionError
from suave_des.registry import manager_class


def test_module_is_found_in_the_current_folder(tmp_path, monkeypatch):
    source = "from suave_des.managing.base import ManagingSubsystem\nclass Mine(ManagingSubsystem):\n    pass\n"
    (tmp_path / "manager_of_this_folder.py").write_text(source)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", ["/nowhere"])
    assert manager_class("manager_of_this_folder:Mine").__name__ == "Mine"


@pytest.mark.parametrize(
    ("source", "problem", "place"),
    [
        ("import sys\nsys.exit(0)\n", "SystemExit", "line 2"),
        ("def broken(:\n", "invalid syntax", "line 1"),
        ("import math\n\nmath.sqrt(-1.0)\n", "ValueError", "line 3"),
        ("from suave_des import Kind\nKIND = Kind.MEASURED\n", "AttributeError", "line 2"),
    ],
    ids=["exits", "syntax", "raises", "raises in a library"],
)
def test_a_module_that_fails_on_import_is_bad_input_with_its_line(
    source, problem, place, tmp_path, monkeypatch
):
    module = f"failing_{problem.replace(' ', '_')}"
    (tmp_path / f"{module}.py").write_text(source)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=problem) as caught:
        manager_class(f"{module}:Mine")
    assert Path(str(caught.value.file)).name == f"{module}.py" and caught.value.place == place
    assert caught.value.remedy is None  # it is no question of where it is


def test_a_module_that_another_thread_still_imports_is_waited_for(tmp_path, monkeypatch):
    mine = "from suave_des.managing.simple import NoManager\nclass Slow(NoManager):\n    pass\n"
    source = f"import time\ntime.sleep(0.5)\n{mine}"
    (tmp_path / "slow_to_import.py").write_text(source)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    first = threading.Thread(target=manager_class, args=("slow_to_import:Slow",))
    first.start()
    while "slow_to_import" not in sys.modules:
        time.sleep(0.01)
    assert manager_class("slow_to_import:Slow").__name__ == "Slow"
    first.join()


def test_ctrl_c_while_a_manager_is_imported_is_ctrl_c(tmp_path, monkeypatch):
    text = "try:\n    raise KeyboardInterrupt\nexcept KeyboardInterrupt as error:\n    raise RuntimeError from error\n"
    (tmp_path / "stopped_while_made.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        manager_class("stopped_while_made:Manager")


DERIVED = """
from suave_des.managing.metacontrol import Metacontrol
from suave_des.managing.simple import NoManager

class Mine({}):
    {}
"""


def derived(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, base: str = "Metacontrol"
) -> str:
    """A manager derived from one that has hooks, with another method."""
    module = f"derived_{tmp_path.name}"
    (tmp_path / f"{module}.py").write_text(DERIVED.format(base, method))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return f"{module}:Mine"


@pytest.mark.parametrize(
    "methods",
    [
        "def adapt(self): self.adapts()\n    def adapts(self): pass",
        "def adapted(self): pass\n    def task_requested(self, task): self.adapted()",
        "def adapt(self): pass\n    def adapt_(self): pass",
        "def plan_ahead(self): pass",
        "adapts = 3",
    ],
)
def test_an_ordinary_method_is_no_misspelt_hook(methods, tmp_path, monkeypatch):
    assert manager_class(derived(methods, tmp_path, monkeypatch)).__name__ == "Mine"


def test_a_misspelt_class_is_answered_with_the_near_one(tmp_path, monkeypatch):
    name = derived("pass", tmp_path, monkeypatch).replace(":Mine", ":Mien")
    with pytest.raises(
        InputError, match=r"no subclass of ManagingSubsystem named 'Mien' .did you mean Mine.."
    ):
        manager_class(name)


def remarks_of(methods: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """What is reported of a manager derived from none, with other methods."""
    return run_mission(
        "seams2023", derived(methods, tmp_path, monkeypatch, base="NoManager")
    ).remarks


def test_an_adapt_that_is_never_called_is_reported(tmp_path, monkeypatch):
    (remark,) = remarks_of("def adapt(self): pass", tmp_path, monkeypatch)
    assert "adapt is never called: period_s is None" in remark


@pytest.mark.parametrize("before", ["period_s = 60.0", "pass"])
def test_the_period_is_given_in_the_class_or_in_init(before, tmp_path, monkeypatch):
    adapt = "def adapt(self): raise ValueError(f'at {self.system.now_s:g} s')"
    init = (
        "def __init__(self, system): self.period_s = 60.0; super().__init__(system)"
        if before == "pass"
        else ""
    )
    name = derived(
        f"{before}\n    starts_s = 7.0\n    {adapt}\n    {init}",
        tmp_path,
        monkeypatch,
        base="NoManager",
    )
    with pytest.raises(MissionError, match="ValueError: at 7 s"):
        run_mission("seams2023", name)
