"""PLANTA as a decision table: what Fast Downward plans in every symbolic state.

From its code (kas-lab/suave_planta, on PlanSys2 with Fast Downward): it plans anew when a
precondition is violated or a goal is new, and reconfigures one function at a time, at 2 Hz; the
visibility is rounded to two decimals, and below what a design needs it is violated; a recovered
thruster is published as RECOVERED while the controller waits for OK, so that the thrusters stay in
fd_recover_thrusters. So a search does not climb when the visibility gets better, until something
is planned anew.

Its own PDDL could not be copied: domain.pddl is ours. Not known here, and assumed: it keeps a
design that can be realised, and else takes the one with the best performance (in domain.pddl, a
reconfiguration costs more than any shortfall); before the first measurement, every design can be
realised; a function without one that can keeps its design, and the others are planned for; the
planner takes no time. PLANTA's real missions are slower than its code explains: the load of its
planner on the simulator may be why, which nobody has shown.

    pip install '.[analysis]'
    python analysis/managers/planta.py
"""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from managers.exemplar import (
    DESIGNS,
    NEEDED_M,
    NO_GROUNDING,
    NONE_LEFT,
    SEARCH,
    STAYS,
    State,
    table,
    write,
)
from suave_des import InputError

DOMAIN = Path(__file__).with_name("domain.pddl")
SETTINGS = """## PLANTA, written by analysis/managers/planta.py with Fast Downward; it says what is known of it and what is assumed.
## Its controller reconfigures one function at a time at 2 Hz (its code); how long it plans is not known. Its real missions are
## slower than its code explains: the load of its planner on the simulator may be why, which nobody has shown.
# period_s: 0.5
# latency_s: 0.0
# functions_at_a_time: 1
# forgets_recovered: false
# as_metacontrol: false
"""


def least_measured_m(needed_m: float) -> float:
    """Find the least visibility, in mm, that is no less than needed once rounded to cm."""
    millimetres = range(round(needed_m * 1000) - 10, round(needed_m * 1000) + 1)
    return next(each / 1000 for each in millimetres if round(each / 1000, 2) >= needed_m)


def is_realisable(design: str, state: State) -> bool:
    """Say whether no precondition of a design is violated."""
    if design == "fd_all_thrusters":
        return state.thrusters == "fine"
    if design in NEEDED_M and state.visibility is not None:
        allowed = DESIGNS[SEARCH].index(state.visibility) if state.visibility else len(NEEDED_M)
        return DESIGNS[SEARCH].index(design) >= allowed
    return True


def decide(state: State) -> dict[str, str]:
    """Plan, if a precondition is violated or a goal is new."""
    goals = {
        function: now
        for function, now in state.now.items()
        if any(is_realisable(design, state) for design in DESIGNS[function])
    }
    found = {name: STAYS if name in goals else NONE_LEFT for name in state.now}
    is_due = any(now == NO_GROUNDING or not is_realisable(now, state) for now in goals.values())
    if is_due:
        found |= dict(_chosen(plan(problem(state, goals))))
    return found


def problem(state: State, goals: Iterable[str]) -> str:
    """Write a state as a PDDL problem."""
    functions = sorted(goals)
    designs = [design for function in functions for design in DESIGNS[function]]
    facts = []
    for function in functions:
        now = state.now[function]
        facts.append(f"(idle {function})" if now == NO_GROUNDING else f"(in_use {function} {now})")
        for shortfall, design in enumerate(DESIGNS[function]):
            facts += [f"(solves {design} {function})", f"(= (shortfall {design}) {shortfall})"]
            facts += [f"(realisable {design})"] if is_realisable(design, state) else []
    return (
        "(define (problem task) (:domain suave)\n"
        f"(:objects {' '.join(functions)} - function {' '.join(designs)} - design)\n"
        f"(:init (= (total-cost) 0) {' '.join(facts)})\n"
        f"(:goal (and {' '.join(f'(performed {name})' for name in functions)}))\n"
        "(:metric minimize (total-cost)))\n"
    )


@cache  # states differ in what the problem does not say, too
def plan(problem_text: str) -> str:
    """Have Fast Downward find the plan of least cost.

    Raises:
        InputError: it is not installed, or finds none.
    """
    package = importlib.util.find_spec("up_fast_downward")
    if package is None or package.origin is None:
        remedy = "pip install '.[analysis]'"
        raise InputError("Fast Downward is not installed", remedy=remedy)
    program = Path(package.origin).parent / "downward" / "fast-downward.py"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "problem.pddl"
        file.write_text(problem_text)
        command = [sys.executable, program, "--plan-file", "plan", DOMAIN, file]
        ended = subprocess.run(
            [*command, "--search", "astar(blind())"], cwd=folder, capture_output=True, text=True
        )
        if ended.returncode:
            raise InputError(f"Fast Downward found no plan: {ended.stdout[-500:]}{ended.stderr}")
        return (Path(folder) / "plan").read_text()


def _chosen(plan_text: str) -> Iterable[tuple[str, str]]:
    """Read the functions whose designs a plan changes, and their new designs."""
    return re.findall(r"\((?:ground|reconfigure) (\S+) (?:\S+ )?(\S+)\)", plan_text)


def text() -> str:
    """Write the table."""
    least_m = {design: least_measured_m(needed_m) for design, needed_m in NEEDED_M.items()}
    return table(SETTINGS, decide, least_m)


if __name__ == "__main__":
    print(write("planta", text()))
