"""Damaged input of every kind is refused in one line, or works: never a traceback, never for ever.

    pytest -m slow tests/attacks

runs all of it; SUAVE_DES_FUZZ=20000 sets how many texts of each kind are tried, in place of 400.
"""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Iterator, Sequence

import pytest

from suave_des.campaign.campaign import run_campaign
from suave_des.errors import InputError, SuaveDesError
from suave_des.exemplar.configurations import import_config
from suave_des.exemplar.keys import REVISIONS
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rules.files import RulesFile
from suave_des.resources import shipped_folder
from suave_des.results.figures import draw_folder
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator
from tests.exemplar.test_import_config import MANAGERS, MISSION_15, MISSION_2023, RUNNER_15
from tests.helpers.command import ends_within

NUMBERS = (
    *(
        "0",
        "-1",
        "5e-324",
        "1e308",
        "1e9",
        ".inf",
        "-.inf",
        ".nan",
        "1_0",
        "０",
        "²",
        "0x10",
        "1:30",
    ),
    "99999999999999",
)
WORDS = (
    *("null", "true", "[]", "{}", "''", "*a", "&a 1", "!!python/object:os.system", "<<: 1"),
    *("\t", "\x1b[31m", "\u202e", "'"),
)
SIGNS = tuple("{}[]()<>,:;^?*&#|!%@`\"'\\/=-+ \n")


def damaged(text: str, seed: int, more: Sequence[str] = ()) -> str:
    """Return a text with one to six damages.

    Args:
        text: what to damage.
        seed: decides what is done.
        more: words of the text's own language to put in.
    """
    stream = random.Random(seed)
    for _ in range(stream.choice((1, 1, 1, 2, 3, 6))):
        text = _damaged_once(text, stream, more)
    return text


def _damaged_once(text: str, stream: random.Random, more: Sequence[str]) -> str:
    lines = text.split("\n")
    place = stream.randrange(len(text) + 1)
    kind = stream.randrange(9)
    if kind == 0:
        return text[:place]
    if kind == 1:
        return text[:place] + stream.choice(SIGNS) + text[place:]
    if kind == 2:
        return text[:place] + text[place + stream.randrange(1, 9) :]
    if kind == 3:
        return text[:place] + stream.choice((*WORDS, *more)) + text[place:]
    if kind == 4:
        lines.insert(stream.randrange(len(lines) + 1), stream.choice(lines))
        return "\n".join(lines)
    if kind == 5 and len(lines) > 1:
        del lines[stream.randrange(len(lines))]
        return "\n".join(lines)
    if kind == 6:
        line = stream.randrange(len(lines))
        lines[line] = stream.choice(("  ", " ", "\t", "    ")) + lines[line]
        return "\n".join(lines)
    numbers = list(_numbers(text))
    if not numbers:
        return text + stream.choice((*NUMBERS, *WORDS))
    first, last = stream.choice(numbers)
    return text[:first] + stream.choice((*NUMBERS, *more)) + text[last:]


def _numbers(text: str) -> Iterator[tuple[int, int]]:
    first = None
    for place, char in enumerate([*text, " "]):
        if char.isdigit() or (char == "." and first is not None):
            first = place if first is None else first
        elif first is not None:
            yield first, place
            first = None


CASES = int(os.environ.get("SUAVE_DES_FUZZ", "400"))
LONGEST_S = 60
SCENARIO = (shipped_folder("scenarios") / "release15.yaml").read_text(encoding="utf-8")
RULE = """\
# a comment
spare: hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ lessThan(?v, 3.5)
       -> fd_realisability(fd_spiral_high, false)
other: Objective(?o) ^ o_status(?o, "UNGROUNDED") ^ swrlb:add(?s, 1, 2) -> o_updatable(?o, true)
"""

# The cases that once led to a traceback, an endless loop or a wrong answer.
BAD_VALUES = {
    "signals.water_visibility.period_s": 5e-324,
    "revision.coordinator.limit_check_period_s": 1e9,
    "thruster_events.²": 1,
    "thruster_events.０": 1,
    "thruster_events.1_0": 1,
}
BAD_EVENTS = ("(１,failure,35)", "(1,failure,1_0)", "(1_0,failure,3)", "(1,failure,٣)")


def refused_in_one_line_or_done(work: Callable[[], object]) -> bool:
    """Whether it was done; an error must be meant for the user, in one line."""
    with ends_within(LONGEST_S):
        try:
            work()
        except SuaveDesError as error:
            assert len(str(error).splitlines()) == 1, str(error)
            return False
        return True


@pytest.mark.parametrize("path", BAD_VALUES)
def test_values_that_no_mission_can_have_are_refused(path):
    with pytest.raises(InputError):
        with_values(load_scenario("release15"), {path: BAD_VALUES[path]})


@pytest.mark.parametrize("event", BAD_EVENTS)
def test_digits_that_only_python_takes_for_such_are_refused(event):
    with pytest.raises(InputError, match="is not a thruster event"):
        with_values(load_scenario("release15"), {"thruster_events": [event]})


@pytest.mark.slow
def test_scenarios(tmp_path):
    path, done = tmp_path / "damaged.yaml", 0
    for seed in range(CASES):
        path.write_text(
            damaged(SCENARIO, seed, ("revision: 2023", "kind: table", "base: seams2023")),
            encoding="utf-8",
        )

        def mission() -> None:
            loaded = load_scenario(path)
            if loaded.scenario.mission.time_limit_s < 1000:
                Simulator(loaded).run("none", 1, 1)

        done += refused_in_one_line_or_done(mission)
    assert 0 < done < CASES


@pytest.mark.slow
def test_rules(tmp_path):
    path, done, vocabulary = tmp_path / "damaged.swrl", 0, Ontology.load().vocabulary
    for seed in range(CASES):
        path.write_text(
            damaged(RULE, seed, ("->", "^", "?x", "swrlb:equal(?x, ?x)", "sameAs(?a, ?b)")),
            encoding="utf-8",
        )
        done += refused_in_one_line_or_done(lambda: RulesFile.read(path).rules(vocabulary))
    assert 0 < done < CASES


@pytest.mark.slow
def test_what_is_imported_of_the_exemplar_s_files_can_be_loaded(tmp_path):
    mission_file, runner_file, out = (
        tmp_path / "mission.yaml",
        tmp_path / "runner.yaml",
        tmp_path / "mine.yaml",
    )
    campaign, done = tmp_path / "campaign.yaml", 0
    for seed in range(CASES):
        mission = (MISSION_2023, MISSION_15)[seed % 2]
        mission_file.write_text(
            damaged(mission, seed, ("task_bridge:", "(1,failure,-3)")), encoding="utf-8"
        )
        runner_file.write_text(damaged(RUNNER_15, seed + CASES), encoding="utf-8")
        options = {
            "revision": list(REVISIONS)[seed % len(REVISIONS)],
            "campaign": campaign,
            "runner_seed": seed if seed % 3 == 0 else None,
            "managers": MANAGERS,
        }
        imported = []
        if not refused_in_one_line_or_done(
            lambda options=options, imported=imported: imported.append(
                import_config([mission_file, runner_file], out, **options)
            )
        ):
            continue
        out.write_text(imported[0].scenario, encoding="utf-8")
        load_scenario(out)  # what import writes is accepted
        done += 1
    assert 0 < done < CASES


@pytest.mark.slow
def test_results(tmp_path):
    run_campaign("seams2023", ["none", "bt"], 4, 1, out=tmp_path / "out")
    runs, done = tmp_path / "out" / "runs.csv", 0
    whole = runs.read_text(encoding="utf-8")
    for seed in range(min(CASES, 150)):
        runs.write_text(
            damaged(whole, seed, ("inf", "-inf", "nan", "-5", '"', "=1+1")), encoding="utf-8"
        )
        done += refused_in_one_line_or_done(
            lambda: draw_folder(tmp_path / "out", tmp_path / "out.png")
        )
    assert done > 0
