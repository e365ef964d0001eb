"""Changes files in the folder of a mission, and lists them in mission.json as a mission would."""

from pathlib import Path

from suave_des.files import write_beside


def write_listed(path: Path, text: str) -> None:
    """Write a file of a mission's folder."""
    write_beside(path.parent, {path.name: text})


def write_cell(path: Path, line: int, column: str, text: str) -> None:
    """Write a CSV file with another text in a cell."""
    lines = path.read_text().splitlines()
    cells = lines[line - 1].split(",")
    cells[lines[0].split(",").index(column)] = text
    lines[line - 1] = ",".join(cells)
    write_listed(path, "\n".join(lines) + "\n")
