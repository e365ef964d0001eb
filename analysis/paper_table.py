"""The paper's table beside the same table of a campaign, as Markdown and CSV.

    suave-des campaign seams2023 --runs 200 --out results
    python analysis/paper_table.py results/runs.csv --out results

The paper: G. Rezende Silva et al., "SUAVE: An Exemplar for Self-Adaptive Underwater Vehicles", SEAMS 2023
(arXiv:2303.09220). Its 60 runs are shipped with the package.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from suave_des import InputError, compare_with_paper, read_runs
from suave_des.results.paper import FILE, published_runs


def main() -> None:
    """Compare the files that the command line names."""
    parser = argparse.ArgumentParser(description="Compare a campaign with the paper's table.")
    parser.add_argument("runs", type=Path, help="runs.csv of a campaign on seams2023")
    parser.add_argument("--published", type=Path, default=published_runs(), help="published runs (default: shipped)")
    parser.add_argument("--out", type=Path, help="folder for paper_table.md")
    arguments = parser.parse_args()
    try:
        comparison = compare_with_paper(read_runs(arguments.runs).frame, arguments.published)
        if arguments.out is not None:
            arguments.out.mkdir(parents=True, exist_ok=True)
            (arguments.out / FILE).write_text(comparison.markdown(), encoding="utf-8")
    except InputError as error:
        print("paper_table.py: " + " ".join(str(error).split()), file=sys.stderr)
        sys.exit(2)
    print(comparison.markdown(), end="")


if __name__ == "__main__":
    main()
