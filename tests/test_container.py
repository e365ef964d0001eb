"""The container is built and flies a mission, where a program that builds one and its base image are; .ci/container sees
to both.
"""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
IMAGE = "localhost/suave-des-test"


def done(*command: str) -> str:
    """What a command prints; an error with its last words where it fails."""
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr[-2000:]
    return result.stdout.strip()


@pytest.fixture(scope="module")
def builder() -> str:
    """A program that builds containers, which has the base image."""
    name = next(filter(shutil.which, ("buildah", "podman")), None)
    if name is None:
        pytest.skip("there is neither buildah nor podman")
    (base,) = re.findall(r"^FROM (.*)$", (ROOT / "Containerfile").read_text("utf-8"), re.MULTILINE)
    start = "from" if name == "buildah" else "create"
    container = subprocess.run([name, start, base], capture_output=True, text=True)
    if container.returncode != 0:
        pytest.skip(f"{name} has no {base}: {container.stderr.strip()[-200:]}")
    done(name, "rm", container.stdout.split()[-1])
    return name


@pytest.fixture(scope="module")
def container(builder: str):
    """The command that runs what follows in the container."""
    done(builder, "build", "-t", IMAGE, ".")
    if builder == "podman":
        yield (builder, "run", "--rm", "--entrypoint=", IMAGE)
    else:
        name = done(builder, "from", IMAGE)
        yield (builder, "run", name, "--")
        done(builder, "rm", name)
    done(builder, "rmi", IMAGE)


@pytest.mark.slow
def test_the_container_has_this_version(container):
    from suave_des import __version__

    assert done(*container, "suave-des", "--version") == f"suave-des {__version__}"


@pytest.mark.slow
def test_the_container_flies_a_mission(container):
    mission = done(*container, "suave-des", "run", "seams2023", "--set", "mission.time_limit_s=30")
    assert "mission" in mission
