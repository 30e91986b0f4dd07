"""The rig's worker at the moments between a run's record and its first move."""

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path

import pytest

from northfinder.records import Records
from northfinder.service.errors import RigOfflineError
from northfinder.service.worker import Worker
from northfinder.wiring import build_rig
from tests.procedures.rigs import SHORT, config_of, virtually


def state_of_a_run(
    tmp_path: Path, meddle: Callable[[Worker], Coroutine[None, None, object]]
) -> str:
    """Start a run on a worker of its own, meddle at the same time, and read how the run ended."""
    url = f"sqlite:///{tmp_path / 'records.db'}"
    config = config_of()

    async def main() -> str:
        with Records.open(url) as records:
            worker = Worker(build_rig(config), records, lambda _: None)
            serving = asyncio.create_task(worker.serve())
            while (await worker.snapshot())["state"] != "ready":  # noqa: ASYNC110 -- as a reader asks
                await asyncio.sleep(0.01)
            starting = asyncio.create_task(worker.start(SHORT, None))
            await meddle(worker)
            run_id = await starting
            await worker.shut_down()
            await serving
            return records.run(run_id).state

    return virtually(config, main())


@pytest.mark.parametrize("turns", [1, 2, 3, 5])
def test_a_service_that_ends_takes_a_run_along_that_is_being_begun(
    tmp_path: Path, turns: int
) -> None:
    async def leave(worker: Worker) -> None:
        for _ in range(turns):  # of the loop
            await asyncio.sleep(0.0)
        await worker.shut_down()

    assert state_of_a_run(tmp_path, leave) == "interrupted"


def test_a_service_that_ends_begins_nothing(tmp_path: Path) -> None:
    with pytest.raises(RigOfflineError, match="the service is ending"):
        state_of_a_run(tmp_path, Worker.shut_down)


def test_a_stop_before_the_first_step_of_a_run_aborts_it(tmp_path: Path) -> None:
    async def stop_at_once(worker: Worker) -> None:
        while worker.run_id is None:  # noqa: ASYNC110 -- every turn of the loop is tried
            await asyncio.sleep(0.0)
        await worker.stop()

    assert state_of_a_run(tmp_path, stop_at_once) == "aborted"
