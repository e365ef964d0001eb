"""Which rules made a manager adapt a function: from the reasoning cycles of a recorded mission, explained again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from suave_des.pages.decisions import Cycle, Cycles, Step, explained
from suave_des.pages.recorded import read_recorded
from suave_des.report.mission_record import MissionRecord, adaptations


def adaptation_rules(folder: Path, record: MissionRecord) -> Mapping[tuple[float, str], tuple[str, ...]]:
    """Find the rules that fired in the reasoning cycle from which each adaptation comes.

    Args:
        folder: of the mission.
        record: what its files say.

    Returns:
        Names of rules, by mission time (s) and function of the adaptation; empty for a manager that does not reason.

    Raises:
        InputError: the mission's files cannot be read.
    """
    known = explained(read_recorded(folder))
    found = {}
    for each in adaptations(record):
        cycle = _decided_in(known.cycles, each.t_s, each.function, each.after)
        if cycle is not None and cycle.inferred >= 0:
            found[each.t_s, each.function] = tuple(_rules(known, cycle, each.function, each.before))
    return found


def _decided_in(cycles: Iterable[Cycle], t_s: float, function: str, design: str) -> Cycle | None:
    """Return the last cycle before a time that chose a design for a function in place of another."""
    last = None
    for cycle in cycles:
        if cycle.t_s > t_s:
            break
        if any(each.function == function and each.before != each.chosen == design for each in cycle.decided):
            last = cycle
    return last


def _rules(known: Cycles, cycle: Cycle, function: str, before: str) -> Iterator[str]:
    """Yield the rules behind what was inferred of a function's objective or of the design that it had."""
    words = before.removeprefix("fd_"), function.removeprefix("f_")
    rules: dict[str, None] = {}
    for step in known.inferences[cycle.inferred].facts:
        if any(word in step.fact for word in words):
            rules |= dict.fromkeys(_of(step))
    yield from rules


def _of(step: Step) -> Iterator[str]:
    for premise in step.because:
        yield from _of(premise)
    if step.rule is not None:
        yield step.rule
