"""suave-des scenarios: what is shipped."""

from __future__ import annotations


def scenarios() -> None:
    """List the shipped scenarios and other inputs."""
    from suave_des.cli.console import output
    from suave_des.cli.tables import plain_table, print_table
    from suave_des.resources import shipped_folder
    from suave_des.scenario.loader import load_scenario

    folder = shipped_folder("scenarios")
    table = plain_table()
    for heading in ("name", "revision", "what it is"):
        table.add_column(heading)
    files = sorted(folder.glob("*.yaml"))
    modes = [path for path in files if path.stem.endswith("_modes")]
    for path in files:
        if path not in modes:
            scenario = load_scenario(path).scenario
            table.add_row(path.stem, scenario.revision.name, scenario.description)
    console = output()
    print_table(console, "Scenarios", table)
    ontologies = sorted(shipped_folder("ontology").glob("*.owl"))
    console.print(f"\nModes files: {', '.join(path.name for path in modes)}", soft_wrap=True)
    console.print(f"Ontologies: {', '.join(path.name for path in ontologies)}", soft_wrap=True)
    console.print(f"They are in {folder.parent}: copy what you want to change.", soft_wrap=True)
