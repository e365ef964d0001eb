"""The inputs of a campaign, which determine its results: scenario, variation, managers and files.

They are read first, which runs no code of the user's; then what they refer to may be trusted or
not, see `trust`; then they are checked, and every file that decides results is hashed.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from suave_des.campaign.ensembles import with_ensemble
from suave_des.campaign.missions import Campaign
from suave_des.campaign.spec import CampaignFile, CampaignSpec
from suave_des.campaign.variation import check_drawn, vary
from suave_des.errors import MISTAKES_LOGGER, InputError
from suave_des.learned import read_file
from suave_des.resources import shown_name
from suave_des.scenario.ensemble import read_ensemble
from suave_des.scenario.loader import LoadedScenario, load_scenario
from suave_des.simulation.inputs import check_inputs

_TIME_OUTS_S = {"owlready2": 1800.0}
"""Time that a mission may take with a reasoner, if not the default: owlready2 takes some two
minutes a mission.
"""


def read_campaign(
    request: CampaignSpec, file: CampaignFile | None, loaded: LoadedScenario | None = None
) -> Campaign:
    """Read the scenario of a campaign, unless it is given, and what varies, without running any
    code of the user's.

    Raises:
        InputError: an input is invalid.
    """
    spec = request.with_file(file)
    loaded = load_scenario(
        loaded or (spec.scenario if file is None else file.scenario), **spec.replacements
    )
    with _located(file):
        loaded, variation = vary(loaded, spec.sweep, spec.perturbations, spec.runs_per_draw)
    inputs: dict[str, str] = {}
    if spec.ensemble is not None:
        ensemble, path, digest = read_ensemble(spec.ensemble)
        variation = with_ensemble(loaded, variation, ensemble, path)
        inputs = {shown_name(path): digest}
    if "time_out_s" not in spec.model_fields_set:
        time_out_s = _TIME_OUTS_S.get(loaded.scenario.knowledge.reasoner, spec.time_out_s)
        spec = spec.model_copy(update={"time_out_s": time_out_s})
    if spec.suave_format and variation.sweep.points > 1:
        remedy = "omit --format suave, or run a campaign for each point"
        raise InputError(
            "the exemplar's results file has no columns for swept values", remedy=remedy
        )
    return Campaign(request, spec, loaded, variation, file, inputs)


@contextmanager
def _located(file: CampaignFile | None) -> Iterator[None]:
    """Add file and line to errors about key paths of a campaign file."""
    try:
        yield
    except InputError as error:
        raise error if file is None else file.located(error) from None


def check_campaign(campaign: Campaign) -> dict[str, str]:
    """Check the inputs of a campaign as check_inputs does, and return the SHA-256 of each further
    file that decides.
    """
    spec = campaign.spec
    with _located(campaign.file):
        check_drawn(campaign.loaded, campaign.variation)
    points = sorted(set(campaign.variation.sweep.each_value()))
    scenarios = (campaign.variation.scenario(campaign.loaded, point).scenario for point in points)
    for words, number in Counter(
        words for each in scenarios for words in each.without_effect()
    ).items():
        where = f", at {number} of {len(points)} swept values" if len(points) > 1 else ""
        logging.getLogger(MISTAKES_LOGGER).warning("note: %s%s", words, where)
    return {
        **campaign.inputs,
        **check_inputs(tuple(campaign.scenarios()), spec.managers, spec.replacements),
    }


def trained_on(campaign: Campaign) -> Iterator[str]:
    """Yield a remark for each manager that was trained on missions of the campaign: its results say
    little.
    """
    own = campaign.loaded.scenario.name, campaign.spec.seed
    for manager in campaign.spec.managers:
        settings = [
            (each, each.manager_settings(manager).get("learned")) for each in campaign.scenarios()
        ]
        files = {
            each.manager_file(manager, str(name)) for each, name in settings if name is not None
        }
        trainings = [read_file(path) for path in files]
        if seen := [each.missions for each in trainings if (each.scenario, each.seed) == own]:
            last = min(campaign.spec.runs, max(seen))
            yield f"{manager}: runs 1 to {last} are missions that it was trained on; give a different --seed"
