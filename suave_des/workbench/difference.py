"""What two knowledge bases decide differently, state by state."""

from __future__ import annotations

from dataclasses import dataclass, field

from suave_des.workbench.policy import Cell, Policy


@dataclass(frozen=True)
class CellPair:
    """One kind of state, as both knowledge bases decide it."""

    one: Cell
    other: Cell

    @property
    def functions(self) -> tuple[str, ...]:
        """Functions whose grounding fares differently."""
        return tuple(name for name in self.one.asked if self.one.outcome(name) != self.other.outcome(name))


@dataclass(frozen=True)
class PolicyDifference:
    """The difference between two policies.

    Attributes:
        compared: number of states that both have.
        differing: kinds of states that they decide differently.
        reported: kinds in which they decide alike, but infer different statuses.
        only_one: function designs that only the first has; likewise only_other.
        computing: rules that compute with numbers; if there are any, the regions are samples and prove nothing.
    """

    compared: int
    differing: tuple[CellPair, ...] = field(repr=False)
    reported: tuple[CellPair, ...] = field(repr=False)
    only_one: tuple[str, ...]
    only_other: tuple[str, ...]
    computing: tuple[str, ...]

    @property
    def states(self) -> int:
        """Number of states that are decided differently."""
        return sum(pair.one.reports.combinations for pair in self.differing)


def compare(one: Policy, other: Policy) -> PolicyDifference:
    """Compare two policies that distinguish the same."""
    there = {(cell.regions, cell.state, cell.asked): cell for cell in other.cells}
    pairs = [
        CellPair(cell, there[cell.regions, cell.state, cell.asked])
        for cell in one.cells
        if (cell.regions, cell.state, cell.asked) in there
    ]
    designs = [{design for cell in policy.cells for _, design in cell.state.groundings} for policy in (one, other)]
    differing: list[CellPair] = []
    alike: list[CellPair] = []
    for pair in pairs:
        (differing if pair.functions or pair.one.marks != pair.other.marks else alike).append(pair)
    return PolicyDifference(
        compared=sum(pair.one.reports.combinations for pair in pairs),
        differing=tuple(differing),
        reported=tuple(pair for pair in alike if pair.one.statuses != pair.other.statuses),
        only_one=tuple(sorted(designs[0] - designs[1])),
        only_other=tuple(sorted(designs[1] - designs[0])),
        computing=tuple(sorted({*one.computing, *other.computing})),
    )
