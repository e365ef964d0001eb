from collections.abc import Callable
from pathlib import Path

import pytest

from suave_des.resources import find

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Writes a file in a fresh current folder and returns its path, relative as a user would give
    it.
    """
    monkeypatch.chdir(tmp_path)

    def write_file(name: str, content: str | bytes) -> Path:
        path = Path(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write_file


@pytest.fixture(scope="session")
def shipped_modes() -> str:
    """Text of the shipped modes file."""
    return find("suave_modes.yaml", "scenarios").read_text(encoding="utf-8")
