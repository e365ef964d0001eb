"""Kills at random moments: no mission is lost or counted twice, and no byte differs."""

import random
import signal
import time

import pytest

from benchmarks import chaos
from suave_des.campaign.campaign import run_campaign
from suave_des.records.store import STORE_FILE, Store, has_campaign

FILES = ("runs.csv", "summary.csv", "manifest.json")
OF_PYTHON_ITSELF = ("in _get_module_details", "Could not import runpy module")
"""What Python says that is stopped before it comes to the program."""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_campaign_that_is_stopped_many_times_has_the_same_bytes(tmp_path, number):
    (tmp_path / "short.yaml").write_text(chaos.SHORT)
    arguments = ["short.yaml", "--managers", ",".join(chaos.MANAGERS), "--runs", "400"]
    whole = chaos.start([*arguments, "--out", "whole"], tmp_path)
    assert chaos.ended(whole)[0] == 0
    stream = random.Random(number)
    process = chaos.start([*arguments, "--out", "killed"], tmp_path)
    for _ in range(12):
        time.sleep(stream.uniform(0.2, 3.0))
        process.send_signal(number)
        status, told = chaos.ended(process)
        is_starting = any(words in told for words in OF_PYTHON_ITSELF)
        assert status in (0, -number, 128 + number) or is_starting, told
        assert "Traceback" not in told or is_starting
        again = (
            ["--resume", "killed"]
            if has_campaign(tmp_path / "killed")
            else [*arguments, "--out", "killed"]
        )
        process = chaos.start(again, tmp_path)
    status, told = chaos.ended(process)
    assert status == 0, told
    for name in FILES[:2]:
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.parametrize("is_made", [True, False], ids=["no table yet", "an empty file"])
def test_one_that_was_killed_before_its_store_had_begun_is_run_as_if_it_had_never_been(
    tmp_path, is_made
):
    (tmp_path / "short.yaml").write_text(chaos.SHORT)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / STORE_FILE).write_bytes(b"")
    if is_made:
        Store(tmp_path / "out" / STORE_FILE)._db.close()
    run_campaign(tmp_path / "short.yaml", ["none"], 2, 1, out=tmp_path / "out")
    assert len((tmp_path / "out" / "runs.csv").read_text().splitlines()) == 1 + 2


@pytest.mark.slow
def test_an_overwriting_campaign_that_is_killed_leaves_no_results_of_the_old_one(tmp_path):
    (tmp_path / "short.yaml").write_text(chaos.SHORT)
    stream = random.Random(1)
    for _ in range(12):
        run_campaign(tmp_path / "short.yaml", ["none"], 5, 1, out=tmp_path / "out", overwrite=True)
        arguments = [
            "short.yaml",
            "--managers",
            "random",
            "--runs",
            "3000",
            "--out",
            "out",
            "--overwrite",
        ]
        process = chaos.start(arguments, tmp_path)
        time.sleep(stream.uniform(0.5, 4.0))
        process.kill()
        chaos.ended(process)
        runs = tmp_path / "out" / "runs.csv"
        if runs.is_file() and has_campaign(tmp_path / "out"):
            managers = {line.split(",")[1] for line in runs.read_text().splitlines()[1:]}
            resumed = chaos.start(["--resume", "out"], tmp_path)
            status, error = chaos.ended(resumed)
            assert status == 0, error
            assert managers == {line.split(",")[1] for line in runs.read_text().splitlines()[1:]}
