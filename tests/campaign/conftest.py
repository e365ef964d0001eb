"""What several test modules of campaigns share."""

from pathlib import Path

import pytest

from benchmarks import chaos


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """A scenario of short missions."""
    path = tmp_path / "short.yaml"
    path.write_text(chaos.SHORT)
    return path
