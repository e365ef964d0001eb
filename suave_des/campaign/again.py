"""Runs missions of a campaign again, with their whole record: the same missions, as all that decides them is kept."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import chdir, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from suave_des.campaign.inputs import check_trusted, read_inputs
from suave_des.campaign.spec import CampaignSpec, read_campaign_file
from suave_des.campaign.store import STORE_FILE, Store
from suave_des.campaign.variation import Variation
from suave_des.errors import InputError, did_you_mean
from suave_des.metrics.result import MissionResult
from suave_des.scenario.loader import LoadedScenario
from suave_des.simulation.simulator import Simulator


@dataclass(frozen=True)
class OpenedCampaign:
    """A campaign whose missions can be run again.

    Attributes:
        spec: what it was asked to do.
        loaded: its scenario.
        variation: what differs between its missions besides manager and run.
    """

    spec: CampaignSpec
    loaded: LoadedScenario
    variation: Variation

    def at_point(self, point: int, run: int | None = None) -> LoadedScenario:
        """Return the scenario at a point of the sweep, 0 without one; with a run, as its member of the ensemble has it.

        Raises:
            InputError: there is no such point.
        """
        if not 0 <= point < self.variation.sweep.points:
            remedy = f"its sweep has the points 0 to {self.variation.sweep.points - 1}"
            raise InputError(f"the campaign has no point {point}", remedy=remedy)
        return self.variation.scenario(self.loaded, point, None if run is None else self.variation.member(run))

    def simulator(self, point: int = 0, run: int | None = None) -> Simulator:
        """Make what runs the missions of a point; with an ensemble, those of a run."""
        return Simulator(self.at_point(point, run), dict.fromkeys(self.variation.drawn, self.spec.runs_per_draw))

    def run(self, manager: str, run: int, point: int = 0, *, simulator: Simulator | None = None) -> MissionResult:
        """Run a mission of the campaign again, with its record.

        Raises:
            InputError: the campaign has no such manager, run or point.
            MissionError: the manager raised.
        """
        if manager not in self.spec.managers:
            remedy = did_you_mean(manager, self.spec.managers, "its managers")
            raise InputError(f"the campaign has no manager {manager!r}", remedy=remedy)
        if not 1 <= run <= self.spec.runs:
            raise InputError(f"the campaign has no run {run}", remedy=f"it has runs 1 to {self.spec.runs}")
        if simulator is None or self.variation.ensemble is not None:
            simulator = self.simulator(point, run)
        return simulator.run(manager, run, self.spec.seed, record=True)


@contextmanager
def opened_campaign(folder: Path, named: Collection[str] = ()) -> Iterator[OpenedCampaign]:
    """Open a campaign, to run missions of it again; what it names is looked up where it was started.

    Args:
        folder: the campaign's.
        named: managers that the user has named: their code may run, see `check_trusted`.

    Raises:
        InputError: there is no campaign in the folder, what it was made of is not there any more, or it names managers
            that are neither installed nor named.
    """
    path = (folder / STORE_FILE).absolute()
    if not path.is_file():
        remedy = "give the --out folder of suave-des run or campaign"
        raise InputError("has no campaign whose missions could be run again", file=folder, remedy=remedy)
    with closing(Store(path)) as store:
        spec = CampaignSpec.of_stored(store.about("request"))
    started_in = Path(spec.folder)
    with chdir(started_in if started_in.is_dir() else Path.cwd()):
        file = read_campaign_file(spec.scenario)
        spec = spec.with_file(file)
        check_trusted(spec.managers, named, folder, confirmed=False)
        spec.check()
        loaded, variation, _ = read_inputs(spec, file)
        yield OpenedCampaign(spec, loaded, variation)
