"""Times both reasoner backends over the same random states, in one run.

    python benchmarks/reasoning.py [--states 50] [--seed 1] [--json]

Each state is new to its backend (nothing is answered from memory), and the in-process backend is warmed up on other
states first. Every pair of inferences is compared: a faster answer that differs would be worth nothing.
"""

from __future__ import annotations

import argparse
import json
import platform
import random
import statistics
import time
from importlib.metadata import version
from typing import Any

from suave_des.knowledge.base import KnowledgeBase
from suave_des.knowledge.reasoners import Reasoner, make_reasoner
from suave_des.knowledge.state import Inference, KnowledgeState, ObjectiveState

WARM_UP = 300
MOTION = "f_maintain_motion"
SEARCH = "f_generate_search_path"


def random_state(draw: random.Random) -> KnowledgeState:
    """A state of a search under way: grounded search and motion, one thruster reported now and then."""
    thruster = f"c_thruster_{draw.randint(1, 6)}"
    status = draw.choice([None, "FALSE", "RECOVERED"])
    return KnowledgeState.of(
        [ObjectiveState(SEARCH), ObjectiveState(MOTION)],
        groundings={
            SEARCH: draw.choice(["fd_spiral_low", "fd_spiral_medium", "fd_spiral_high"]),
            MOTION: draw.choice(["fd_all_thrusters", "fd_recover_thrusters"]),
        },
        components={thruster: status} if status else {},
        measurements={"water_visibility": draw.uniform(1.0, 4.0), "battery_level": draw.random()},
    )


def timed(reasoner: Reasoner, states: list[KnowledgeState]) -> tuple[list[float], list[Inference]]:
    """Seconds that each state took, and its inference."""
    times_s, inferences = [], []
    for state in states:
        begin_s = time.perf_counter()
        inferences.append(reasoner.infer(state))
        times_s.append(time.perf_counter() - begin_s)
    return times_s, inferences


def percentile_ms(times_s: list[float], percent: int) -> float:
    """A percentile, in milliseconds."""
    if percent == 50:
        return 1e3 * statistics.median(times_s)
    return 1e3 * sorted(times_s)[min(len(times_s) - 1, len(times_s) * percent // 100)]


def measure(count: int, seed: int) -> dict[str, Any]:
    """Load, warm up and time both backends.

    Raises:
        SystemExit: the backends do not infer the same.
    """
    draw = random.Random(seed)
    states = [random_state(draw) for _ in range(count)]
    begin_s = time.perf_counter()
    kb = KnowledgeBase.load()
    load_s = time.perf_counter() - begin_s
    begin_s = time.perf_counter()
    pellet = make_reasoner("pellet", kb)
    pellet.infer(random_state(draw))
    first_s = time.perf_counter() - begin_s
    timed(pellet, [random_state(draw) for _ in range(WARM_UP)])
    stock = make_reasoner("owlready2", kb)
    stock.infer(random_state(draw))  # its first call has the in-process Pellet check the rules
    summaries, found = {}, []
    for reasoner in (pellet, stock):
        times_s, inferences = timed(reasoner, states)
        found.append(inferences)
        summaries[reasoner.name] = {
            "median_ms": percentile_ms(times_s, 50),
            "p99_ms": percentile_ms(times_s, 99),
            "mean_ms": 1e3 * statistics.fmean(times_s),
        }
    if found[0] != found[1]:
        raise SystemExit("the backends do not infer the same: see tests/knowledge/test_backends_agree.py")
    return {
        "states": count,
        "seed": seed,
        "versions": {"python": platform.python_version(), "owlready2": version("owlready2")},
        "load_ontologies_ms": 1e3 * load_s,
        "start_java_and_first_inference_ms": 1e3 * first_s,
        "inference": summaries,
        "ratio_of_medians": summaries["owlready2"]["median_ms"] / summaries["pellet"]["median_ms"],
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Times both reasoner backends over the same random states.")
    parser.add_argument("--states", type=int, default=50, help="how many states (default 50)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the states (default 1)")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    arguments = parser.parse_args()
    results = measure(arguments.states, arguments.seed)
    if arguments.json:
        print(json.dumps(results, indent=2))
        return
    print(f"{'reasoner':<12}{'median ms':>12}{'p99 ms':>12}{'mean ms':>12}")
    for name, summary in results["inference"].items():
        print(f"{name:<12}" + "".join(f"{summary[key]:>12.2f}" for key in ("median_ms", "p99_ms", "mean_ms")))
    print(f"{arguments.states} states, the same inferences; pellet is {results['ratio_of_medians']:.0f} times faster")
    print(f"ontologies loaded in {results['load_ontologies_ms']:.0f} ms", end=", ")
    print(f"Java started and the first state reasoned on in {results['start_java_and_first_inference_ms']:.0f} ms")


if __name__ == "__main__":
    main()
