"""suave-des schema: the JSON Schema of scenario files."""

from __future__ import annotations


def schema() -> None:
    """Print the JSON Schema of scenario files.

    Editors and other tools use it to complete and check scenarios.
    """
    import json

    from suave_des.scenario.schema import scenario_schema

    print(json.dumps(scenario_schema(), indent=2))
