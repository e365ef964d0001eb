"""The page on clusters: its Slurm script runs, with dask-jobqueue itself and a stand-in for Slurm's own commands."""

import os
import subprocess
import sys
import time
from pathlib import Path

from doc_blocks import ROOT, blocks_of

import suave_des

# Keeps the script, as Slurm does: dask-jobqueue removes it as soon as it is submitted.
SBATCH = "#!/bin/sh\ncp $1 job.sh\nbash job.sh > job.log 2>&1 &\necho $! >> jobs\necho Submitted batch job $!\n"
SCANCEL = "#!/bin/sh\nkill $@\n"


def test_the_slurm_script_runs(tmp_path):
    (script,) = [block.text for block in blocks_of(ROOT / "docs" / "guides" / "cluster.md") if "title" in block.marks]
    for shown, short in (("cores=32", "cores=1"), ("jobs=4", "jobs=1"), ("runs=100_000", "runs=2")):
        assert shown in script
        script = script.replace(shown, short)
    (tmp_path / "on_slurm.py").write_text(script, encoding="utf-8")
    commands = tmp_path / "bin"
    commands.mkdir()
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (commands / name).write_text(text)
        (commands / name).chmod(0o755)
    environment = {
        **os.environ,
        "PATH": f"{commands}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(Path(suave_des.__file__).parents[1]),
    }
    done = subprocess.run(
        [sys.executable, "on_slurm.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.stdout == "6 missions are in on_slurm/runs.csv\n", done.stderr
    assert len((tmp_path / "on_slurm" / "runs.csv").read_text().splitlines()) == 1 + 6
    (job,) = (tmp_path / "jobs").read_text().split()
    end_s = time.monotonic() + 60.0
    while Path(f"/proc/{job}").exists():  # which closing the cluster has cancelled
        assert time.monotonic() < end_s
        time.sleep(0.1)
