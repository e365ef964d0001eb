"""Whatever is in a file that describes missions: it is read, or there is one error for the user."""

import json
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from suave_des.campaign.inputs import read_campaign
from suave_des.campaign.spec import CampaignSpec, read_campaign_file
from suave_des.errors import InputError
from suave_des.learned import Learned, read_learned
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.modes import modes_of
from suave_des.scenario.yamlfile import read_yaml

ODD = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**30), 10**30),
    st.floats(),
    st.sampled_from(["", "..", "/", "/dev", "~", "seams2023", "\ud800", "nan", "1e999", "a: b"]),
    st.text(max_size=5),
    st.lists(st.integers(), max_size=2),
    st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
)
CAMPAIGN = """
campaign: 1
scenario: seams2023
managers: [none, metacontrol]
runs: 3
seed: 1
workers: 1
sweep: {visibility.period_s: [80, 120]}
perturbations: {thruster_events.0.time_s: {distribution: normal, mean: 1, std: 2}}
runs_per_draw: 2
"""
TRAINED = Learned("mine:M", "seams2023", 0, 3, {"a.py": "0" * 64}, {"q": [1.0]}).text()


@cache
def shipped(name: str) -> str:
    return (shipped_folder("scenarios") / f"{name}.yaml").read_text()


def leaves(data: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the places of all values in plain data."""
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    below = [(*path, key) for key, _ in entries]
    held = [place for place in below if isinstance(value_at(data, place[-1:]), dict | list)]
    return [*below, *(each for place in held for each in leaves(data[place[-1]], place))]


def value_at(data: Any, place: tuple[Any, ...]) -> Any:
    for key in place:
        data = data[key]
    return data


@st.composite
def damaged(draw: st.DrawFn, text: str) -> bytes:
    """Return a file with a value that does not belong there, or with bytes that do not."""
    if draw(st.booleans()):
        data = yaml.safe_load(text)
        place = draw(st.sampled_from(leaves(data)))
        value_at(data, place[:-1])[place[-1]] = draw(ODD)
        return json.dumps(data).encode()
    content = text.encode()
    begin = draw(st.integers(0, len(content)))
    end = draw(st.integers(begin, min(begin + 20, len(content))))
    return content[:begin] + draw(st.binary(max_size=6)) + content[end:]


def read_modes(path: Path) -> None:
    modes_of(read_yaml(path))


def read_whole_campaign(path: Path) -> None:
    file = read_campaign_file(path)
    if file is not None:
        read_campaign(CampaignSpec.of(path), file)


@pytest.mark.parametrize(
    ("text", "read"),
    [
        (shipped("seams2023"), load_scenario),
        (shipped("extended"), load_scenario),
        (shipped("suave_modes"), read_modes),
        (CAMPAIGN, read_whole_campaign),
        (TRAINED, read_learned),
    ],
    ids=["scenario", "extended scenario", "modes", "campaign", "training"],
)
def test_a_damaged_file_is_read_or_refused(text, read, tmp_path):
    @settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
    @given(damaged(text))
    def check(content: bytes) -> None:
        path = tmp_path / "file.yaml"
        path.write_bytes(content)
        with suppress(InputError):
            read(path)

    check()
