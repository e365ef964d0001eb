"""What `kb check` finds without a reasoner is told before missions run, once, on standard error."""

import logging
from pathlib import Path

import pytest

from suave_des import run_campaign
from suave_des.errors import MISTAKES_LOGGER, Finding
from suave_des.knowledge.checks import Subject, findings_in
from suave_des.knowledge.ontology import Ontology
from tests.helpers.command import command_here

STATUS = 'nothing in the simulation reports c_status "False" (did you mean "FALSE"?)'


@pytest.fixture(autouse=True)
def told_nothing_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("suave_des.simulation.inputs._told", set())


@pytest.fixture
def wrong_rule(tmp_path: Path) -> str:
    (tmp_path / "mine.swrl").write_text(
        'Late: c_status(?c, "False") -> Role(?c)\n', encoding="utf-8"
    )
    return "mine.swrl"


def campaign(
    tmp_path: Path, *options: str, scenario: str = "seams2023", managers: str = "none"
) -> None:
    """Run a campaign of one run; what it tells is logged, which goes to standard error outside
    tests.
    """
    (tmp_path / "out").mkdir()
    arguments = (
        "campaign",
        scenario,
        "--runs",
        "1",
        "--managers",
        managers,
        "--workers",
        "1",
        "--out",
        "out",
    )
    done = command_here(*arguments, *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_a_mistaken_rule_is_told_in_the_words_of_kb_check(tmp_path, wrong_rule, caplog):
    campaign(tmp_path, "--rules", wrong_rule)
    finding, pointer = caplog.messages
    assert finding == f"WARN   mine.swrl: line 1, rule Late, column 20: {STATUS}"
    assert (
        finding
        in command_here("kb", "check", "--rules", wrong_rule, cwd=tmp_path).stdout.splitlines()
    )
    assert "suave-des kb check" in pointer


def test_quiet_campaigns_do_not_tell(tmp_path, wrong_rule, caplog):
    campaign(tmp_path, "--rules", wrong_rule, "--quiet")
    assert not caplog.messages
    assert not logging.getLogger(MISTAKES_LOGGER).disabled


@pytest.mark.parametrize("scenario", ["seams2023", "extended"])
def test_shipped_files_are_not_even_checked(scenario, tmp_path, monkeypatch):
    monkeypatch.setattr("suave_des.knowledge.checks.findings_in", lambda *_: pytest.fail("checked"))
    campaign(tmp_path, scenario=scenario, managers="metacontrol")


def test_files_are_checked_again_only_when_they_were_changed(
    tmp_path, wrong_rule, monkeypatch, caplog
):
    checks: list[Subject] = []

    def counted(base: Ontology, subject: Subject) -> list[Finding]:
        checks.append(subject)
        return findings_in(base, subject)

    monkeypatch.setattr("suave_des.knowledge.checks.findings_in", counted)
    for status, number in (("False", 1), ("False", 1), ("FALSE", 2), ("Flase", 3), ("False", 3)):
        (tmp_path / wrong_rule).write_text(
            f'Late: c_status(?c, "{status}") -> Role(?c)\n', encoding="utf-8"
        )
        run_campaign("seams2023", "none", 1, rules=[tmp_path / wrong_rule])
        assert len(checks) == number
    assert [STATUS in message for message in caplog.messages] == [True, False, False, False]
