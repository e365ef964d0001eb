"""kb check: numbers that measured values are compared with in vain, as missions never measure such values."""

from __future__ import annotations

from pathlib import Path

import pytest

from suave_des.findings import Finding, Level
from suave_des.knowledge.checks import static_findings
from suave_des.knowledge.ontology_file import collect
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.scenario_knowledge import measured_ranges, subject_of

MEASURED = "hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v)"


def warned(tmp_path: Path, comparison: str, values: dict[str, object] | None = None) -> list[Finding]:
    """The warnings about a rule with a comparison, in the scenario of 2023 with other values."""
    rules = tmp_path / "mine.swrl"
    rules.write_text(f"mine: {MEASURED} ^ {comparison} -> fd_realisability(fd_spiral_high, false)\n")
    subject = subject_of(load_scenario("seams2023", rules=[rules]))
    if values:
        subject = subject_of(with_values(load_scenario("seams2023", rules=[rules]), values))
    found = static_findings(subject, collect(subject.given))
    return [each for each in found if each.level is not Level.INFO]


@pytest.mark.parametrize(
    ("comparison", "outcome"),
    [
        ("lessThan(?v, 250)", "always"),
        ("greaterThan(?v, 4.0)", "never"),
        ("lessThan(4.0, ?v)", "never"),
        ("notEqual(?v, -1)", "always"),
        ("equal(?v, 3.76)", "never"),
        ("lessThan(?v, 1.25)", "never"),
        ("greaterThanOrEqual(?v, 1.25)", "always"),
        ('greaterThan(?v, "4.0"^^xsd:float)', "never"),
    ],
)
def test_a_number_beyond_all_measured_values_is_a_warning(comparison: str, outcome: str, tmp_path: Path) -> None:
    (warning,) = warned(tmp_path, comparison)
    assert f"{outcome} holds in this scenario: water_visibility is between 1.25 and 3.75" in warning.message
    assert (Path(str(warning.file)).name, warning.rule) == ("mine.swrl", "mine")


@pytest.mark.parametrize(
    "comparison",
    [
        "lessThan(?v, 3.5)",
        "lessThanOrEqual(?v, 1.25)",
        "greaterThan(3.75, ?v)",
        "equal(?v, 3.75)",
        "notEqual(?v, 2)",
        "swrlb:add(?w, ?v, 300) ^ lessThan(?w, 302)",
        "hasQAestimation(fd_spiral_high, ?e) ^ hasValue(?e, ?w) ^ lessThan(?w, 250)",
    ],
)
def test_a_number_among_the_measured_values_is_none(comparison: str, tmp_path: Path) -> None:
    assert warned(tmp_path, comparison) == []


def test_the_range_is_that_of_the_scenario(tmp_path: Path) -> None:
    deeper = {"signals.water_visibility.maximum": 300.0}
    assert warned(tmp_path, "lessThan(?v, 250)", deeper) == []
    noisy = {"signals.water_visibility.noise": {"distribution": "normal", "mean": 0.0, "std": 100.0}}
    assert warned(tmp_path, "lessThan(?v, 250)", noisy) == []


def test_every_kind_of_signal_has_its_range(tmp_path: Path) -> None:
    (tmp_path / "depth.csv").write_text("t_s,value\n0,4.5\n10,2.5\n20,3\n")
    scenario = tmp_path / "mine.yaml"
    scenario.write_text(
        "base: extended\nsignals:\n"
        "  one: {kind: constant, value: 2.0}\n"
        "  drawn: {kind: constant, value: {distribution: uniform, minimum: 0, maximum: 1}}\n"
        "  step: {kind: step, time_s: 50, before: 3.0, after: 1.0}\n"
        "  table: {kind: table, file: depth.csv}\n"
    )
    ranges = measured_ranges(load_scenario(scenario))
    assert {name: ranges.get(name) for name in ("one", "drawn", "step", "table", "battery_level")} == {
        "one": (2.0, 2.0),
        "drawn": None,
        "step": (1.0, 3.0),
        "table": (2.5, 4.5),
        "battery_level": (0.0, 1.0),
    }
