"""Kills a campaign at random moments, many times, and compares its bytes with those of an undisturbed one.

    python benchmarks/chaos.py [--kills N] [--seed N] [--runs N]

Half of the kills strike a worker first and the whole campaign a little later; after each, it is resumed.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "campaign"))

import chaos

MANAGERS = ("none", "random")


def main() -> None:
    """Kill, resume, compare; exit status 1 if a byte differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, default=20_000, help="missions for each manager")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "short.yaml").write_text(chaos.SHORT)
        asked = ["short.yaml", "--managers", ",".join(MANAGERS), "--runs", str(arguments.runs), "--workers", "2"]
        status, err = chaos.ended(chaos.start([*asked, "--out", "whole"], folder))
        assert status == 0, err
        began_s = time.monotonic()
        done = chaos.survive(arguments.kills, random.Random(arguments.seed), folder, asked, longest_s=0.5)
        same = (folder / "out" / "runs.csv").read_bytes() == (folder / "whole" / "runs.csv").read_bytes()
        moments = len({count for count in done if 0 < count < len(MANAGERS) * arguments.runs})
        print(
            f"{len(done)} kills in {time.monotonic() - began_s:.0f} s, at {moments} different counts of missions done"
        )
        print("the bytes are the same" if same else "THE BYTES DIFFER")
        sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
