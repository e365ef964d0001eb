"""ROSA as a decision table: its rules, as they are published, in every symbolic state.

From its code (kas-lab/suave, suave_rosa): it plans at each diagnostic and at each task, and takes
the feasible configuration with the least priority number. Not known here, and assumed: the
priorities are in the order of the designs' performance; a design is feasible from the visibility
that it needs on; where nothing is measured, each is; where none is, the design in use is kept; its
queries take no time.

    python analysis/managers/rosa.py
"""

from __future__ import annotations

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from managers.exemplar import DESIGNS, NEEDED_M, NONE_LEFT, SEARCH, STAYS, State, table, write

SETTINGS = """## ROSA, written by analysis/managers/rosa.py, which says what is known of it and what is assumed.
## It plans at each diagnostic and at each task (its code); how long its queries take is not known.
# trigger: event
# latency_s: 0.0
# as_metacontrol: false
"""


def is_feasible(design: str, state: State) -> bool:
    """Say whether no constraint of a design is violated."""
    if design == "fd_all_thrusters":
        return state.thrusters != "failed"
    if design in NEEDED_M and state.visibility is not None:
        allowed = DESIGNS[SEARCH].index(state.visibility) if state.visibility else len(NEEDED_M)
        return DESIGNS[SEARCH].index(design) >= allowed
    return True


def decide(state: State) -> dict[str, str]:
    """Take the feasible design with the least priority number, for each function."""
    found = {}
    for function, now in state.now.items():
        feasible = (design for design in DESIGNS[function] if is_feasible(design, state))
        best = next(feasible, NONE_LEFT)
        found[function] = STAYS if best == now else best
    return found


def text() -> str:
    """Write the table."""
    return table(SETTINGS, decide, NEEDED_M)


if __name__ == "__main__":
    print(write("rosa", text()))
