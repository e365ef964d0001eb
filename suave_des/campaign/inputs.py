"""What a campaign is made of: its scenario, what varies, and the files that these name."""

from __future__ import annotations

from suave_des.campaign.ensemble import read_ensemble, with_ensemble
from suave_des.campaign.manager_inputs import check_managers, scenarios_of
from suave_des.campaign.provenance import check_knowledge
from suave_des.campaign.spec import CampaignFile, CampaignSpec
from suave_des.campaign.variation import Variation, vary
from suave_des.errors import InputError
from suave_des.scenario.layers import Files
from suave_des.scenario.loader import LoadedScenario, Replacements, check_not_replaced, load_scenario

TIME_OUT_S = 120.0
TIME_OUTS_S = {"owlready2": 1800.0}
"""Time that a mission may take with a reasoner, if not TIME_OUT_S: owlready2 takes some two minutes a mission."""
_REASONER = "knowledge.reasoner"


def read_inputs(
    spec: CampaignSpec, file: CampaignFile | None, loaded: LoadedScenario | None = None
) -> tuple[LoadedScenario, Variation, dict[str, str]]:
    """Read what a campaign is made of: the scenario, what varies, and the SHA-256 of each input file.

    Raises:
        InputError: something cannot be used.
    """
    replacements: Replacements = {
        "ontologies": spec.ontologies,
        "modes_file": spec.modes_file,
        "reasoner": spec.reasoner,
        "rules": spec.rules,
        "disabled_rules": spec.disabled_rules,
        "values": spec.values,
        "manager_options": spec.manager_options,
    }
    if loaded is None:
        loaded = load_scenario(spec.scenario if file is None else file.scenario, **replacements)
    else:
        check_not_replaced(loaded, replacements)
    given = bool(spec.ontologies or spec.rules or spec.disabled_rules)
    try:
        loaded, variation = vary(loaded, spec.sweep, spec.perturbations, spec.runs_per_draw, spec.seed)
    except InputError as error:
        raise error if file is None else file.located(error) from None
    files = Files()
    if spec.ensemble is not None:
        is_from_file = file is not None and "ensemble" in spec.from_file
        beside = file.layer.place(("ensemble",)).file.parent if file is not None and is_from_file else None
        ensemble, path, digest = read_ensemble(spec.ensemble, beside)
        variation = with_ensemble(loaded, variation, ensemble, path)
        files.note(path, digest)
    inputs = {**check_knowledge(loaded, spec.managers, given=given), **files.inputs}
    inputs |= check_managers(scenarios_of(loaded, variation), spec.managers)
    return loaded, variation, inputs if file is None else {**inputs, **file.inputs}


def default_time_out_s(loaded: LoadedScenario, variation: Variation) -> float:
    """Return the time that a mission may take if none is given: it follows from the reasoners."""
    sweep, name = variation.sweep, next((name for name, path in variation.paths.items() if path == _REASONER), None)
    swept = [] if name is None else [sweep.values(point)[name] for point in sweep.each_value()]
    return max(TIME_OUTS_S.get(str(each), TIME_OUT_S) for each in (loaded.scenario.knowledge.reasoner, *swept))
