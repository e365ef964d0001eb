"""Print the lowest versions that pyproject.toml allows, as constraints for pip: python
.ci/lowest.py > lowest.txt.
"""

import re
import tomllib
from pathlib import Path

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))[
    "project"
]
LOWER_BOUND = re.compile(r"^([A-Za-z0-9_.-]+)(?:\[[^]]*\])?\s*>=\s*([0-9.]+)")

for dependency in (
    *PROJECT["dependencies"],
    *(each for extra in PROJECT["optional-dependencies"].values() for each in extra),
):
    if found := LOWER_BOUND.match(dependency):
        print(f"{found[1]}=={found[2]}")
