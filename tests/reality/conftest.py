from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import pandas
import pytest

Write = Callable[..., Path]
Missions = Callable[..., pandas.DataFrame]


@pytest.fixture(scope="module")
def few_resamples() -> Iterator[None]:
    """Has validations permute and subsample a tenth as often as users have them."""
    from suave_des.results import statistics

    with pytest.MonkeyPatch.context() as patch:
        for function, times in (
            (statistics.anderson_darling, {"permutations": statistics.PERMUTATIONS // 10}),
            (statistics.agreement, {"subsamples": statistics.SUBSAMPLES // 10}),
        ):
            patch.setattr(statistics, function.__name__, partial(function, **times))
        yield


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a file in a fresh folder."""

    def write_file(name: str, content: str) -> Path:
        path = tmp_path / name
        path.write_text(content, encoding="utf-8")
        return path

    return write_file


@pytest.fixture
def missions() -> Missions:
    """Makes a frame of missions from search times, distances and places of detection by manager."""

    def frame(by_manager: Mapping[str, Sequence[tuple[float, float, float]]]) -> pandas.DataFrame:
        rows = [
            (manager, *values)
            for manager, all_values in by_manager.items()
            for values in all_values
        ]
        columns = ["manager", "search_time_s", "distance_inspected_m", "detection_x_m"]
        return pandas.DataFrame(rows, columns=columns).assign(pipeline_found=float("nan"))

    return frame
