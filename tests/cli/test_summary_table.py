"""The table that a campaign prints: short and narrow also for long sweeps of drawn values."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from suave_des.cli.main import main

HEAD = "campaign: 1\nscenario: short.yaml\nmanagers: [none]\nruns: 1\n"
SHORT = "base: seams2023.yaml\nmission: {time_limit_s: 2}\n"
PERIODS = "sweep:\n  visibility.period_s: [{}]\n"
SAMPLE = """\
sample:
  method: sobol
  points: 8
  ranges:
    visibility.period_s: [40, 160]
    signals.water_visibility.minimum: [1.25, 1.75]
    start.x_m: [-18, -16]
"""


def printed(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Run a campaign file's missions; return the lines from the table's heading on."""
    (folder / "short.yaml").write_text(SHORT)
    (folder / "sweep.yaml").write_text(HEAD + text)
    with pytest.raises(SystemExit, match="0"):
        main(["campaign", str(folder / "sweep.yaml"), "--out", str(folder / "out"), "--workers", "1", "--quiet"])
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize(("points", "shown"), [(40, 40), (41, 39), (57, 39)])
def test_a_long_sweep_has_its_first_rows_and_where_the_others_are(
    points: int, shown: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = printed(PERIODS.format(", ".join(str(40 + number) for number in range(points))), tmp_path, capsys)
    rows = [line.split()[0] for line in lines if line.split()[1:2] == ["none"]]
    assert rows == [str(40 + number) for number in range(shown)]
    more = [line for line in lines if "rows more" in line]
    if shown == points:
        assert more == []
    else:
        assert more == [f"... and {points - shown} rows more, all in {tmp_path}/out/summary.csv"]
    with (tmp_path / "out" / "summary.csv").open() as file:
        assert sum(1 for _ in csv.DictReader(file)) == points


@pytest.mark.parametrize(("width", "digits"), [(80, 4), (200, 6)])
def test_drawn_values_are_rounded_and_names_broken_to_fit_the_terminal(
    width: int, digits: int, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    lines = printed("sweep:\n" + "".join(f"  {line}\n" for line in SAMPLE.splitlines()), tmp_path, capsys)
    table = lines[: next(number for number, line in enumerate(lines) if "missions are in" in line)]
    assert max(map(len, table)) <= width
    assert not any("…" in line for line in table)
    rows = [line.split()[:3] for line in table if "none" in line.split()]
    with (tmp_path / "out" / "summary.csv").open() as file:
        parameters = ("visibility.period_s", "signals.water_visibility.minimum", "start.x_m")
        exact = [[float(row[parameter]) for parameter in parameters] for row in csv.DictReader(file)]
    assert rows == [[f"{value:.{digits}g}" for value in values] for values in exact]
    assert any(len(repr(value)) > 8 for values in exact for value in values)  # or nothing was rounded
