"""Times the answers to recurring questions about rules that do not fire: within a second each, after the first.

    python -m benchmarks.why_not

What is asked is what tests/helpers/rule_questions.py lists; loading the ontology of each question is not counted.
"""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from suave_des.resources import shipped_folder
from tests.helpers.rule_questions import CASES, prepared

LONGEST_S = 1.0
FIRST = "a value on the limit"


def answer_s(name: str) -> float:
    """Seconds from a question to its answer.

    Raises:
        SystemExit: the answer is not the one that is listed.
    """
    with TemporaryDirectory() as folder:
        ontology = Path(folder) / "suave.owl"
        text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
        ontology.write_text(text.replace("</rdf:RDF>", CASES[name][2] + "</rdf:RDF>"), encoding="utf-8")
        asked = prepared(name, ontology, Path(folder))
        began_s = time.perf_counter()
        found = str(asked.questions.why_not(asked.rule, asked.state))
        taken_s = time.perf_counter() - began_s
    if asked.answer not in found:
        raise SystemExit(f"{name}: {found}")
    return taken_s


def main() -> None:
    """Ask a question that starts Java, then all of them; exit status 1 if an answer takes too long."""
    first_s = answer_s(FIRST)
    print(f"{first_s:7.3f} s  the first answer, with the start of Java")
    times_s = {name: answer_s(name) for name in CASES}
    for name, taken_s in times_s.items():
        print(f"{taken_s:7.3f} s  {name}")
    longest_s = max(times_s.values())
    print(f"{len(times_s)} answers, the longest after {longest_s:.3f} s (at most {LONGEST_S:g} s wanted)")
    raise SystemExit(longest_s > LONGEST_S)


if __name__ == "__main__":
    main()
