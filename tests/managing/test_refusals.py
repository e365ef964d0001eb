"""Managers that cannot be used are refused, before any mission, with what is said of them."""

from collections.abc import Callable
from pathlib import Path

import pytest

from suave_des import run_campaign, run_mission
from suave_des.cli.files import tree
from suave_des.errors import InputError
from suave_des.managing.bt import ExtendedBehaviourTree
from suave_des.registry import manager_class
from suave_des.resources import find
from suave_des.scenario.loader import load_scenario


def without_a_mode_for_the_station(folder: Path) -> None:
    modes = find("suave_extended_modes.yaml", "scenarios").read_text()
    lacking = modes.replace("      inactive:\n        generate_recharge_path_node: inactive\n", "")
    assert lacking != modes
    (folder / "modes.yaml").write_text(lacking)
    (folder / "own.yaml").write_text("base: extended\nmodes_file: modes.yaml\n")
    ExtendedBehaviourTree.check(load_scenario(folder / "own.yaml"))


REFUSALS: list[tuple[Callable[[Path], object] | str, str]] = [
    ("no.such.module:Mine", "no module named 'no'"),
    ("suave_des.managing.simple:Nobody", "no subclass of ManagingSubsystem named 'Nobody'"),
    ("suave_des.managing.simple:Task", "no subclass of ManagingSubsystem"),
    ("suave_des.managing.simple:", "no subclass of ManagingSubsystem"),
    (":Mine", "empty module name"),
    ("zebra", "no manager 'zebra'"),
    ("fixed:", "write fixed:MODE"),
    (
        lambda _: run_campaign("seams2023", ["fixed:fd_spiral_hihg"], runs=1),
        "did you mean 'fd_spiral_high'",
    ),
    (without_a_mode_for_the_station, "has no mode 'inactive', which it requests"),
    (lambda _: tree("metacontrol"), "has no tree"),
    (lambda _: run_mission("extended", "rosa"), "no row decides generate_recharge_path"),
    (lambda _: run_mission("extended", "planta"), "no row decides generate_recharge_path"),
]
"""A manager's name, or what is done with one, and what is said."""


@pytest.mark.parametrize("given", REFUSALS, ids=lambda row: row[1])
def test_a_manager_that_cannot_be_used_is_refused_with_the_reason(tmp_path, given):
    refused, said = given
    with pytest.raises(InputError, match=f"(?i){said}"):
        manager_class(refused) if isinstance(refused, str) else refused(tmp_path)
