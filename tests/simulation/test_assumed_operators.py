"""Ontologies of 2023 without qa_comparison_operator: the revision says how values compare, as its code did."""

from pathlib import Path

import pytest

from suave_des.campaign.inputs import check_inputs
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator
from tests.helpers.exemplar_files import write_as_owlready2_saves_it


def test_missions_are_those_with_the_operator_written_in(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    owl = write_as_owlready2_saves_it(tmp_path / "suave.owl", placeholder="FunctionDesign")
    assert "<tomasys:qa_comparison_operator" not in owl.read_text(encoding="utf-8")
    loaded = load_scenario("seams2023", ontologies=[owl])
    check_inputs([loaded], ["metacontrol"], {})
    assert caplog.text.count("water_visibility has no qa_comparison_operator in the ontologies: < is assumed") == 1
    without, with_operator = Simulator(loaded), Simulator(load_scenario("seams2023"))
    for run in range(1, 4):
        assert without.run("metacontrol", run, 1, record=True) == with_operator.run("metacontrol", run, 1, record=True)
