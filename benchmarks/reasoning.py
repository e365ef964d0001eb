"""Times the reasoners over the same random states, in one run, and what else reasoning costs,
against what is wanted.

    python benchmarks/reasoning.py [--states 200] [--seed 1] [--json]

Each state is new to its backend (nothing is answered from memory, unless that is what is measured),
and Pellet is warmed up on other states first. Every pair of inferences is compared: a faster answer
that differs would be worth nothing. Stock owlready2 takes about a second for each state, so 200
states take some minutes.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import random
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import Inference, KnowledgeState, ObjectiveState
from suave_des.resources import shipped_folder

WARM_UP = 300
LEAK_STATES = 20_000
GROWTH = (10, 30, 100, 300)
MOTION = "f_maintain_motion"
SEARCH = "f_generate_search_path"
_FIRST = """
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
state = KnowledgeState.of([ObjectiveState({search!r})], groundings={{{search!r}: "fd_spiral_high"}},
                          measurements={{"water_visibility": "1"}})
assert Reasoner(Ontology.load(), {name!r}).analyze(state).facts
"""
_MORE_DESIGNS = """
<owl:NamedIndividual rdf:about="http://www.metacontrol.org/suave#qa_{n}">
<rdf:type rdf:resource="http://metacontrol.org/tomasys#QAvalue"/>
<tomasys:isQAtype rdf:resource="http://www.metacontrol.org/suave#water_visibility"/>
<tomasys:hasValue rdf:datatype="http://www.w3.org/2001/XMLSchema#decimal">{value}</tomasys:hasValue>
</owl:NamedIndividual>
<owl:NamedIndividual rdf:about="http://www.metacontrol.org/suave#fd_{n}">
<rdf:type rdf:resource="http://metacontrol.org/tomasys#FunctionDesign"/>
<tomasys:solvesF rdf:resource="http://www.metacontrol.org/suave#f_generate_search_path"/>
<tomasys:hasQAestimation rdf:resource="http://www.metacontrol.org/suave#qa_{n}"/>
</owl:NamedIndividual>
"""


def random_state(draw: random.Random) -> KnowledgeState:
    """A state of a search under way: grounded search and motion, one thruster reported now and
    then.
    """
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
        inferences.append(reasoner.analyze(state))
        times_s.append(time.perf_counter() - begin_s)
    return times_s, inferences


def percentile_ms(times_s: list[float], percent: int) -> float:
    """A percentile, in milliseconds."""
    if percent == 50:
        return 1e3 * statistics.median(times_s)
    return 1e3 * sorted(times_s)[min(len(times_s) - 1, len(times_s) * percent // 100)]


def seconds(work: Callable[[], object]) -> float:
    """What a piece of work takes."""
    begin_s = time.perf_counter()
    work()
    return time.perf_counter() - begin_s


@contextmanager
def empty_memory() -> Iterator[Path]:
    """A cache folder of its own, so that what the user's reasoners remember counts for nothing."""
    before = os.environ.get("SUAVE_DES_CACHE_DIR")
    with TemporaryDirectory() as folder:
        os.environ["SUAVE_DES_CACHE_DIR"] = folder
        try:
            yield Path(folder)
        finally:
            os.environ.pop("SUAVE_DES_CACHE_DIR")
            if before is not None:
                os.environ["SUAVE_DES_CACHE_DIR"] = before


def measure_backends(kb: Ontology, count: int, draw: random.Random) -> dict[str, Any]:
    """Time all backends over the same states; the cached one when it has inferred their like
    before.

    Raises:
        SystemExit: the backends do not infer the same.
    """
    states = [random_state(draw) for _ in range(count)]
    pellet = Reasoner(kb, "pellet")
    timed(pellet, [random_state(draw) for _ in range(WARM_UP)])
    stock = Reasoner(kb, "owlready2")
    stock.analyze(random_state(draw))  # its first call has the in-process Pellet check the rules
    cached = Reasoner(kb)
    timed(cached, states)
    summaries, found = {}, []
    # The same states as new objects: nothing about them is known but what they say.
    again = [
        KnowledgeState(one.objectives, one.groundings, one.components, one.measurements)
        for one in states
    ]
    for reasoner, asked in ((pellet, states), (stock, states), (cached, again)):
        times_s, inferences = timed(reasoner, asked)
        found.append(inferences)
        summaries[reasoner.name] = {
            "median_ms": percentile_ms(times_s, 50),
            "p99_ms": percentile_ms(times_s, 99),
            "mean_ms": 1e3 * statistics.fmean(times_s),
        }
    if not found[0] == found[1] == found[2]:
        raise SystemExit(
            "the backends do not infer the same: see tests/knowledge/test_backends_agree.py"
        )
    return summaries


def first_inference_s(name: str) -> float:
    """From the start of a process to its first inference; the best of three, since others use the
    machine too.
    """
    program = _FIRST.format(search=SEARCH, name=name)
    return min(
        seconds(lambda: subprocess.run([sys.executable, "-c", program], check=True))
        for _ in range(3)
    )


def policy_s() -> tuple[float, int]:
    """To fill an empty memory for the whole policy, and how many states that covers."""
    with empty_memory():
        knowledge = KnowledgeBase.load()
        begin_s = time.perf_counter()
        policy = knowledge.policy(max_failed=2)
        return time.perf_counter() - begin_s, policy.states


def growth(draw: random.Random) -> list[dict[str, float]]:
    """What ontologies of more designs cost, each design with an expected value of its own."""
    rows = []
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    for designs in GROWTH:
        with empty_memory() as folder:
            more = "".join(
                _MORE_DESIGNS.format(n=n, value=f"{4 * (n + 1) / designs:.4f}")
                for n in range(designs - 6)
            )
            path = folder / "suave.owl"
            path.write_text(text.replace("</rdf:RDF>", more + "</rdf:RDF>"), encoding="utf-8")
            kb = Ontology.load([path])
            states = [random_state(draw) for _ in range(200)]
            pellet_s, _ = timed(Reasoner(kb, "pellet"), states)
            cached = Reasoner(kb)
            timed(cached, states)
            hits_s, _ = timed(cached, states * 5)
            rows.append(
                {
                    "designs": designs,
                    "thresholds": len(cached.regions.thresholds),
                    "pellet_ms": percentile_ms(pellet_s, 50),
                    "cached_hit_us": 1e3 * percentile_ms(hits_s, 50),
                }
            )
    return rows


def resident_mb() -> float:
    """Memory of this process."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def leak_mb(kb: Ontology, draw: random.Random) -> float | None:
    """Growth of this process over many inferences of Pellet; None where the system does not
    tell.
    """
    if not Path("/proc/self/statm").exists():
        return None
    pellet = Reasoner(kb, "pellet")
    timed(pellet, [random_state(draw) for _ in range(WARM_UP)])
    before = resident_mb()
    for _ in range(LEAK_STATES):
        pellet.analyze(random_state(draw))
    return resident_mb() - before


def measure(count: int, seed: int) -> dict[str, Any]:
    """Load, warm up and time everything."""
    draw = random.Random(seed)
    kb = Ontology.load()
    with empty_memory() as folder:
        load_s = seconds(Ontology.load)
        summaries = measure_backends(kb, count, draw)
        first = {name: first_inference_s(name) for name in ("pellet", "cached")}
        # or the last two of the three had no cached inference
        assert any((folder / "inferences").iterdir())
    filled_s, states = policy_s()
    results: dict[str, Any] = {
        "states": count,
        "seed": seed,
        "versions": {"python": platform.python_version(), "owlready2": version("owlready2")},
        "load_ontologies_ms": 1e3 * load_s,
        "inference": summaries,
        "pellet_times_faster_than_owlready2": summaries["owlready2"]["median_ms"]
        / summaries["pellet"]["median_ms"],
        "cached_hit_us": 1e3 * summaries["cached"]["median_ms"],
        "process_start_to_first_inference_s": first,
        "policy": {"states": states, "fill_s": filled_s},
        "growth": growth(draw),
        "memory_growth_mb": {"inferences": LEAK_STATES, "mb": leak_mb(kb, draw)},
    }
    results["goals"] = list(goals(results))
    return results


def goals(results: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """What is wanted of each figure, what it is, and whether that will do."""
    faster = results["pellet_times_faster_than_owlready2"]
    yield _goal("pellet, times faster than owlready2", ">=", 400.0, faster)
    yield _goal("a cache hit, us", "<=", 5.0, results["cached_hit_us"])
    first_s = results["process_start_to_first_inference_s"]["pellet"]
    yield _goal("process start to first inference of pellet, s", "<=", 1.0, first_s)
    yield _goal("memory filled for the whole policy, s", "<=", 10.0, results["policy"]["fill_s"])
    least, *_, most = results["growth"]
    times = most["designs"] / least["designs"]
    growth = most["cached_hit_us"] / least["cached_hit_us"]
    yield _goal(f"a hit with {times:.0f} times the designs, times as long", "<=", times, growth)
    if results["memory_growth_mb"]["mb"] is not None:
        yield _goal(
            f"{LEAK_STATES} inferences, MB more", "<=", 100.0, results["memory_growth_mb"]["mb"]
        )


def _goal(figure: str, sign: str, goal: float, measured: float) -> dict[str, Any]:
    met = measured >= goal if sign == ">=" else measured <= goal
    return {"figure": figure, "goal": f"{sign} {goal:g}", "measured": measured, "met": met}


def print_table(results: dict[str, Any]) -> None:
    """Everything for people."""
    print(f"{'reasoner':<12}{'median ms':>12}{'p99 ms':>12}{'mean ms':>12}")
    for name, summary in results["inference"].items():
        print(
            f"{name:<12}"
            + "".join(f"{summary[key]:>12.4f}" for key in ("median_ms", "p99_ms", "mean_ms"))
        )
    ratio = results["pellet_times_faster_than_owlready2"]
    print(
        f"{results['states']} states, the same inferences; pellet is {ratio:.0f} times faster than owlready2,"
    )
    print(f"a cache hit takes {results['cached_hit_us']:.1f} us")
    for name, first_s in results["process_start_to_first_inference_s"].items():
        print(f"from process start to the first inference, {name}: {first_s:.2f} s")
    policy = results["policy"]
    print(
        f"memory filled for the whole policy, {policy['states']} states, in {policy['fill_s']:.1f} s"
    )
    print(f"\n{'designs':>8}{'thresholds':>12}{'pellet ms':>12}{'hit us':>10}")
    for row in results["growth"]:
        print(
            f"{row['designs']:>8}{row['thresholds']:>12}{row['pellet_ms']:>12.2f}{row['cached_hit_us']:>10.1f}"
        )
    grown = results["memory_growth_mb"]
    if grown["mb"] is not None:
        print(
            f"\n{grown['inferences']} inferences of pellet made the process {grown['mb']:.0f} MB larger"
        )
    print(f"\n{'figure':<52}{'goal':>10}{'measured':>12}  met")
    for row in results["goals"]:
        print(
            f"{row['figure']:<52}{row['goal']:>10}{row['measured']:>12.2f}  {'yes' if row['met'] else 'NO'}"
        )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Times the reasoners over the same random states.")
    parser.add_argument("--states", type=int, default=200, help="how many states (default 200)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the states (default 1)")
    parser.add_argument("--json", action="store_true", help="print JSON after the table")
    arguments = parser.parse_args()
    results = measure(arguments.states, arguments.seed)
    print_table(results)
    if arguments.json:
        print(json.dumps(results, indent=2))


if __name__ == "__main__":
    main()
