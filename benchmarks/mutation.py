"""Times the mutation of the shipped rules and data against their shipped tests: a hundred mutants within 30 s.

    python benchmarks/mutation.py [--mutants 100]

What is counted is what `kb test --mutate` does after the ontologies are loaded, with the start of Java; user and system
time are those of this process. On a machine that is busy with other things, wall time says nothing.
"""

from __future__ import annotations

import argparse
import time

from suave_des.workbench import KnowledgeBase
from suave_des.workbench.testing.mutants import mutants_of, sample
from suave_des.workbench.testing.mutation import EQUIVALENT, KILLED, SURVIVED, mutate
from suave_des.workbench.testing.reading import TestFile, shipped_tests

LONGEST_S = 30.0


def main() -> None:
    """Command line; exit status 1 if it takes too long."""
    parser = argparse.ArgumentParser(description="Times the mutation of the shipped rules and data.")
    parser.add_argument("--mutants", type=int, default=100, help="how many mutants (default 100)")
    parser.add_argument("--verbose", action="store_true", help="print what became of each mutant")
    arguments = parser.parse_args()
    bench = KnowledgeBase.load()
    tests = [test for file in shipped_tests() for test in TestFile.read(file).tests(bench)]
    mutants = sample(mutants_of(bench.base), arguments.mutants)
    began_s, began_cpu_s = time.perf_counter(), time.process_time()
    report = mutate(bench, tests, mutants, max_failed=1)
    wall_s, cpu_s = time.perf_counter() - began_s, time.process_time() - began_cpu_s
    for verdict in report.verdicts if arguments.verbose else ():
        print(f"{verdict.result}: {verdict.mutant}: {verdict.reason}")
    counts = ", ".join(f"{len(report.of(result))} {result}" for result in (KILLED, EQUIVALENT, SURVIVED))
    print(f"{len(mutants)} mutants, {len(tests)} tests: {counts}; score {report.score:.1%}")
    print(f"{wall_s:.1f} s, {cpu_s:.1f} s of user and system time; {1e3 * wall_s / len(mutants):.0f} ms for a mutant")
    allowed_s = LONGEST_S * len(mutants) / 100
    print(f"at most {allowed_s:g} s wanted")
    raise SystemExit(wall_s > allowed_s)


if __name__ == "__main__":
    main()
