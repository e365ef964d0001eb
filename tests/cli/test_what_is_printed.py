"""What commands print of what is known elsewhere: managers, and how metrics are written."""

from suave_des.registry import manager_names


def test_scenarios_lists_every_manager(command):
    printed = command("scenarios").out
    (line,) = [each for each in printed.splitlines() if each.startswith("Managers: ")]
    assert line.removeprefix("Managers: ").split(", ") == list(manager_names())


def test_run_writes_further_metrics_as_tables_do(command):
    ended = command(
        *("run", "extended", "--manager", "none"),
        *("--set", "mission.time_limit_s=20"),
        *("--set", "metrics=[battery_level, area_covered_m2, recharges]"),
    )
    lines = [line.split() for line in ended.out.splitlines()]
    assert ["battery", "level", "0.899"] in lines  # 1 - 20 s / 200 s, at the last tick
    assert ["recharges", "0"] in lines
    (area,) = [line for line in lines if line[:2] == ["area", "covered"]]
    assert area[3:] == ["m2"]
