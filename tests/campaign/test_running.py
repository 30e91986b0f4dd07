"""Whoever computes the chunks, in whatever order: the same numbers."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pyarrow as pa
import pytest
from pyarrow import parquet

from northfinder.campaign import chunks, dask_cluster, running
from northfinder.campaign.carrying_out import carry_out
from northfinder.campaign.chunks import Columns, run_chunk
from northfinder.campaign.errors import CampaignError
from northfinder.campaign.running import chunk_results
from northfinder.campaign.settings import SEEKS_PER_CHUNK, Campaign
from northfinder.errors import ConfigError
from tests.campaign.campaigns import SEQUENTIAL, planned

CAMPAIGN = planned(seeks=2 * SEEKS_PER_CHUNK + 500, tilt_deg=5.0)


def equal(one: Columns, other: Columns) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[n], other[n]) for n in one)


@pytest.fixture(scope="module")
def expected() -> list[Columns]:
    return [run_chunk(CAMPAIGN, chunk) for chunk in range(CAMPAIGN.chunks)]


def test_a_chunk_needs_no_other_and_the_last_has_the_rest(expected: list[Columns]) -> None:
    assert [len(columns["error_deg"]) for columns in expected] == [10_000, 10_000, 500]
    assert equal(run_chunk(CAMPAIGN, 1), expected[1])
    assert not np.array_equal(expected[0]["error_deg"], expected[1]["error_deg"])


def test_another_seed_gives_other_numbers(expected: list[Columns]) -> None:
    other = run_chunk(CAMPAIGN.model_copy(update={"seed": 2}), 2)
    assert not np.any(other["error_deg"] == expected[2]["error_deg"])


def test_the_sums_do_not_depend_on_how_many_threads_may_be_used(expected: list[Columns]) -> None:
    with chunks.one_thread():
        assert equal(run_chunk(CAMPAIGN, 2), expected[2])


@pytest.mark.parametrize("worth", [1, 10**9], ids=["processes", "threads"])
def test_cores_give_what_one_gives(
    worth: int, expected: list[Columns], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(running, "_WORTH_PROCESSES", worth)
    found = dict(chunk_results(CAMPAIGN, run_chunk))
    assert sorted(found) == [0, 1, 2]
    assert all(equal(found[chunk], expected[chunk]) for chunk in found)


def test_what_is_finished_is_not_computed_again() -> None:
    assert [chunk for chunk, _ in chunk_results(CAMPAIGN, run_chunk, finished={0, 1})] == [2]
    assert list(chunk_results(CAMPAIGN, run_chunk, "tcp://nobody:1", finished={0, 1, 2})) == []


def test_a_process_that_dies_is_said_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "_WORTH_PROCESSES", 1)
    with (
        pytest.raises(CampaignError, match="a process that computed chunks ended"),
        running._cores(1) as (pool, _),
    ):
        pool.submit(os._exit, 1).result()


OPTIONS = ("--seeks", "600000", "--order", "sequential")


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> pa.Table:
    folder = tmp_path_factory.mktemp("uninterrupted")
    carry_out(planned(SEQUENTIAL, seeks=600_000), folder)
    return parquet.read_table(folder / "seeks.parquet")


def interrupted(command: list[str], chunks: Path, how: str) -> tuple[int, str]:
    """Start a command, interrupt it once a chunk is kept; returns how it ended and said.

    Ctrl-C reaches all processes of a terminal, a kill the one that it is meant for.
    """
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while not any(chunks.glob("*.parquet")):
        with suppress(subprocess.TimeoutExpired):
            process.wait(0.02)
        assert process.poll() is None, process.communicate()[1]
    workers = psutil.Process(process.pid).children()
    if how == "kill":
        process.kill()
    else:
        for each in (process.pid, *(worker.pid for worker in workers)):
            os.kill(each, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert psutil.wait_procs(workers, timeout=30)[1] == []  # nobody is left behind
    return process.returncode, said


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize("how", ["Ctrl-C", "kill"])
def test_an_interrupted_campaign_goes_on_to_the_same_end(
    tmp_path: Path, how: str, uninterrupted: pa.Table
) -> None:
    command = [sys.executable, "-m", "northfinder", "campaign", *OPTIONS, "--output", str(tmp_path)]
    code, said = interrupted(command, tmp_path / "chunks", how)
    if how == "Ctrl-C":
        assert code == 130
        assert f"of 600,000 seeks are kept in {tmp_path}" in said
        assert "Traceback" not in said
    assert 0 < len(list((tmp_path / "chunks").glob("*.parquet"))) < 60
    subprocess.run(command, check=True, capture_output=True)
    assert parquet.read_table(tmp_path / "seeks.parquet").equals(uninterrupted)


def test_without_dask_its_command_line_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigError, match=r"Dask is not installed; pip install"):
        list(chunk_results(CAMPAIGN, run_chunk, "tcp://127.0.0.1:8786"))


@pytest.mark.parametrize(
    "address", ["nobody", "tcp://nobody", "tcp://nobody:door", "http://a:1", "tcp://:1", ""]
)
def test_what_is_no_address_is_refused_before_anybody_is_asked(address: str) -> None:
    with pytest.raises(ConfigError, match=r"write it as tcp://HOST:8786"):
        list(chunk_results(CAMPAIGN, run_chunk, address))


@pytest.mark.slow
def test_nobody_at_the_address_is_said_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_cluster, "_ANSWER_S", 0.5)
    with pytest.raises(CampaignError, match=r"no Dask scheduler answers at tcp://127.0.0.1:9"):
        list(chunk_results(CAMPAIGN, run_chunk, "tcp://127.0.0.1:9"))


@pytest.fixture
def cluster(request: pytest.FixtureRequest) -> Iterator[str]:
    distributed: Any = import_module("distributed")
    settings = {"threads_per_worker": 1, "dashboard_address": ":0", "processes": True}
    with distributed.LocalCluster(n_workers=request.param, **settings) as made:
        yield made.scheduler_address


@pytest.mark.slow
@pytest.mark.parametrize("cluster", [1, 2], indirect=True)
def test_dask_gives_the_same_columns_to_the_last_bit(cluster: str, tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    tally = carry_out(CAMPAIGN, here)
    assert carry_out(CAMPAIGN, there, cluster).shares == tally.shares
    one, other = (parquet.read_table(folder / "seeks.parquet") for folder in (here, there))
    assert one.equals(other)


@pytest.mark.slow
@pytest.mark.parametrize("cluster", [0], indirect=True)
def test_a_cluster_without_workers_is_said_in_a_sentence(cluster: str) -> None:
    with pytest.raises(CampaignError, match="has no workers: start some"):
        list(chunk_results(CAMPAIGN, run_chunk, cluster))


def test_a_campaign_of_few_seeks_asks_for_no_more_cores_than_chunks() -> None:
    few = CAMPAIGN.model_copy(update={"seeks": 10})
    assert isinstance(few, Campaign)
    ((chunk, columns),) = chunk_results(few, run_chunk)
    assert (chunk, len(columns["error_deg"])) == (0, 10)
