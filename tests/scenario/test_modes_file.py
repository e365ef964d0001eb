"""System Modes files: the modes of each function, and each way in which a file is refused."""

import pytest

from suave_des.errors import InputError
from suave_des.resources import find
from suave_des.scenario.modes import Mode, ModeTable, modes_of
from suave_des.scenario.yamlfile import read_yaml

SEARCH = """\
/f_generate_search_path:
  ros__parameters:
    type: system
    parts: f_generate_search_path_node
    modes:
      fd_unground: {f_generate_search_path_node: inactive}
      fd_spiral_low: {/f_generate_search_path_node: active.low}
      fd_spiral_high: {f_generate_search_path_node: active.high}
      fd_plain: {f_generate_search_path_node: active}
f_generate_search_path_node:
  ros__parameters:
    type: node
    modes:
      __DEFAULT__: {ros__parameters: {spiral_altitude: 1.5, label: deep}}
      low: {ros__parameters: {spiral_altitude: 1}}
      high: {ros__parameters: {spiral_altitude: 3.0, label: high, camera: true}}
"""


def read_modes(path) -> ModeTable:
    return modes_of(read_yaml(path))


def changed(old: str, new: str) -> str:
    assert SEARCH.count(old) == 1
    return SEARCH.replace(old, new)


SPIRALS = ("fd_spiral_low", "fd_spiral_medium", "fd_spiral_high")


def test_the_shipped_file_has_the_altitudes_of_the_exemplar():
    table, function = read_modes(find("suave_modes.yaml", "scenarios")), "f_generate_search_path"
    altitudes_m = {
        mode: table.mode(function, mode).parameters.get("spiral_altitude")
        for mode in table.modes(function)
    }
    names = ("__DEFAULT__", "fd_unground", *SPIRALS)
    assert altitudes_m == dict(zip(names, (1.0, None, 1.0, 2.0, 3.0), strict=True))


def test_the_shipped_file_has_the_active_modes_of_the_exemplar():
    table = read_modes(find("suave_modes.yaml", "scenarios"))
    active = {
        f"{name} {mode}"
        for name in table.functions
        for mode in table.modes(name)
        if table.mode(name, mode).active
    }
    assert active == {
        *(f"f_generate_search_path {mode}" for mode in ("__DEFAULT__", *SPIRALS)),
        "f_follow_pipeline fd_follow_pipeline",
        "f_maintain_motion fd_recover_thrusters",
        "f_maintain_motion __DEFAULT__",
        "generate_recharge_path normal",
    }


def test_modes_take_their_parameters_from_the_node_over_its_default(write):
    table = read_modes(write("m.yaml", SEARCH))
    assert table.functions == ("f_generate_search_path",)
    assert table.mode("f_generate_search_path", "fd_spiral_low") == Mode(
        "fd_spiral_low", True, {"spiral_altitude": 1.0, "label": "deep"}
    )
    assert table.mode("f_generate_search_path", "fd_spiral_high").parameters == {
        "spiral_altitude": 3.0,
        "label": "high",
        "camera": True,
    }
    assert table.mode("f_generate_search_path", "fd_plain").parameters == {
        "spiral_altitude": 1.5,
        "label": "deep",
    }
    assert table.mode("f_generate_search_path", "fd_unground") == Mode("fd_unground", False, {})


def test_a_function_without_default_mode_gets_an_inactive_one(write):
    table = read_modes(write("m.yaml", SEARCH))
    assert table.modes("f_generate_search_path")[0] == "__DEFAULT__"
    assert not table.mode("f_generate_search_path", "__DEFAULT__").active


def test_a_function_of_several_parts_is_active_when_one_is(write):
    table = read_modes(
        write(
            "m.yaml",
            "f:\n  ros__parameters:\n    type: system\n    parts:\n      a\n      b\n    modes:\n"
            "      one: {a: inactive, b: active.m}\n      none: {a: inactive, b: inactive}\n"
            "a: {ros__parameters: {type: node}}\n"
            "b: {ros__parameters: {type: node, modes: {m: {ros__parameters: {x: 2}}}}}\n",
        )
    )
    assert table.mode("f", "one") == Mode("one", True, {"x": 2.0})
    assert not table.mode("f", "none").active


def test_asking_for_an_unknown_mode_or_function_names_the_nearest(write):
    table = read_modes(write("m.yaml", SEARCH))
    with pytest.raises(
        InputError,
        match=r"^m\.yaml: .* has no mode 'fd_spiral_hihg' \(did you mean 'fd_spiral_high'\?",
    ):
        table.mode("f_generate_search_path", "fd_spiral_hihg")
    with pytest.raises(
        InputError, match=r"^m\.yaml: there is no function 'f_search' \(.*f_generate_search_path\)"
    ):
        table.modes("f_search")


LOW = "low: {ros__parameters: {spiral_altitude: 1}}"


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        (
            changed("parts: f_generate_search_path_node", "parts: f_search_node"),
            "line 4, ",
            "part 'f_search_node'",
        ),
        (
            changed("    parts: f_generate_search_path_node\n", ""),
            "line 2, ",
            "ros__parameters.parts: is missing",
        ),
        (changed("active.low", "active.lwo"), "line 7, ", "has no mode 'lwo' (did you mean 'low'?"),
        (changed("active.low", "true"), "line 7, ", "true is not a state of a node"),
        (
            changed("{f_generate_search_path_node: active}", "{f_other: active}"),
            "line 9, ",
            "'f_other' is not a part",
        ),
        (
            changed("{f_generate_search_path_node: active}", "active"),
            "line 9, ",
            "fd_plain: 'active' should be a map",
        ),
        (
            changed("spiral_altitude: 3.0", "spiral_altitude: high"),
            "line 16, ",
            "'high' should be a number",
        ),
        (
            changed("spiral_altitude: 3.0", "spiral_altitude: -3"),
            "line 16, ",
            "-3 should be greater than 0",
        ),
        (
            changed("spiral_altitude: 3.0", "spiral_altitud: 3.0"),
            "line ",
            "nothing reads 'spiral_altitud' (did you",
        ),
        (changed("camera: true", "camera: .nan"), "line 16, ", ".nan is not a value"),
        (changed(LOW, "low: {spiral_altitude: 1}"), "line 15, ", "(known: ros__parameters"),
        (
            changed("type: node", "type: nod"),
            "line 12, ",
            "'nod' is not allowed (did you mean 'node'?",
        ),
        (
            changed("    type: node\n", "    type: node\n    mods: {}\n"),
            "line 13, ",
            "did you mean 'modes'?",
        ),
        ("f:\n  type: system\n", "line 2, f.type", "(known: ros__parameters"),
        (SEARCH + "f_generate_search_path: {}\n", "line 17, ", "appears twice"),
        ("a: {ros__parameters: {type: node}}\n", "line 1", "defines no function"),
    ],
)
def test_a_wrong_modes_file_is_refused(write, content, place, words):
    with pytest.raises(InputError) as caught:
        read_modes(write("m.yaml", content))
    assert str(caught.value).startswith(f"m.yaml: {place}")
    assert words in str(caught.value)
