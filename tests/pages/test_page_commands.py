"""suave-des replay and report: what they take, and what they say where they cannot."""

import json
import re
from importlib.resources import files

import pytest

from suave_des import run_mission
from suave_des.pages.replay import mission_on_page
from suave_des.records.mission_folder import read_mission
from suave_des.resources import shipped_folder


@pytest.fixture(scope="module")
def mission(tmp_path_factory):
    folder = tmp_path_factory.mktemp("missions") / "bt"
    run_mission("seams2023", "bt", 2, 1, folder)
    return folder


def test_decisions_of_metacontrol_are_explained_as_they_were_made(tmp_path):
    run_mission("seams2023", "metacontrol", 1, 1, tmp_path / "mission")
    page = mission_on_page(read_mission(tmp_path / "mission"))
    decided = [
        (each["function"], each["before"], each["chosen"])
        for cycle in page["cycles"]["cycles"]
        for each in cycle["decided"]
    ]
    grounded = [detail for _, _, event, detail in page["events"] if event == "adaptation"]
    changes = {
        (function, before, chosen) for function, before, chosen in decided if before != chosen
    }
    for detail in grounded:
        function, _, change = detail.partition(": ")
        before, _, rest = change.partition(" -> ")
        assert (
            function,
            None if before == "ungrounded" else before,
            rest.partition(":")[0],
        ) in changes
    rules = {
        fact["rule"]
        for each in page["cycles"]["inferences"]
        for fact in each["facts"]
        if fact["rule"]
    }
    assert rules <= page["cycles"]["rules"].keys()


def test_an_ontology_beside_the_scenario_is_found_from_elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own").mkdir()
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    (tmp_path / "own" / "suave.owl").write_text(text.replace(">3.25<", ">2.75<"), encoding="utf-8")
    (tmp_path / "own" / "own.yaml").write_text(
        "base: seams2023\nknowledge: {ontologies: [suave.owl]}\n", encoding="utf-8"
    )
    run_mission("own/own.yaml", "metacontrol", 1, 1, tmp_path / "mission")
    assert mission_on_page(read_mission(tmp_path / "mission"))["cycles"]["note"] == ""


def test_a_mission_whose_ontology_is_gone_is_played_without_explanations(tmp_path):
    folder = tmp_path / "mission"
    run_mission("seams2023", "metacontrol", 1, 1, folder)
    record = json.loads((folder / "mission.json").read_text(encoding="utf-8"))
    record["scenario"]["knowledge"]["ontologies"] = ["gone.owl"]
    (folder / "mission.json").write_text(json.dumps(record), encoding="utf-8")
    page = mission_on_page(read_mission(folder))
    assert "gone.owl" in page["cycles"]["note"]
    assert page["cycles"]["cycles"][0]["measured"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((), "there is nothing to play"),
        (("gone",), "no such folder"),
        (("{mission}", "--seed", "3"), "--seed cannot be used with DIR"),
        (("{mission}", "--scenario", "seams2023"), "both DIR and --scenario"),
        (("{campaign}", "--run", "9"), "run: 9 "),
        (("{campaign}", "--managers", "bd"), "there is no manager 'bd'"),
        (("{campaign}", "--point", "4"), "point: 4 "),
        (("--scenario", "seams2023", "--managers", "none,bt,random"), "2 side by side at most"),
        (("--scenario", "seams2023", "--run", "0"), "run: 0 is out of range"),
        (("--scenario", "seams2023", "--out", "no/where.html"), "no/where.html"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_replay_says_what_is_wrong(
    arguments, told, mission, campaign, tmp_path, monkeypatch, command
):
    monkeypatch.chdir(tmp_path)
    given = [each.format(mission=mission, campaign=campaign) for each in arguments]
    status, _, error = command("replay", *given)
    assert status == 2 and told in error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("asked", [("replay", "a"), ("kb", "infer", "--at", "a@3")], ids=" ".join)
def test_a_folder_that_is_a_link_in_a_circle_is_told_as_one(asked, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    status, _, error = command(*asked)
    assert status == 2 and "a: is a link in a circle" in error


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("a,b\n1,2\n", "has no column"),
        ("manager,search_time_s,distance_inspected_m\n", "no missions"),
    ],
    ids=["foreign", "no missions"],
)
def test_report_says_what_is_wrong(content, told, tmp_path, command):
    (tmp_path / "runs.csv").write_text(content, encoding="utf-8")
    status, _, error = command("report", tmp_path)
    assert status == 2 and told in error
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize("ground", ["card", "paper"])
@pytest.mark.parametrize("theme", [":root {", ':root[data-theme="dark"] {'])
def test_text_stands_out_from_its_ground(theme, ground):
    style = files("suave_des").joinpath("pages", "assets", "common.css").read_text(encoding="utf-8")
    found = re.findall(r"--(\w+): #([0-9a-f]{6})", style[style.index(theme) :].partition("}")[0])

    def luminance(name):  # as WCAG 2.2 defines it
        parts = (part / 255.0 for part in bytes.fromhex(dict(found)[name]))
        linear = [
            part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
        ]
        return sum(
            share * part for share, part in zip((0.2126, 0.7152, 0.0722), linear, strict=True)
        )

    for text in ("ink", "soft", "faint", "accent", "good", "bad", "warm"):
        dark, bright = sorted((luminance(text), luminance(ground)))
        assert (bright + 0.05) / (dark + 0.05) >= 4.5, text
