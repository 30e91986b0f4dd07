"""One run from the command line: recorded, followed on the terminal, printed."""

import asyncio
from typing import Any

from pydantic import BaseModel

from northfinder.cli.options import AS_FAST_AS_IT_GOES, database_url
from northfinder.cli.progress import LiveProgress
from northfinder.cli.results import show_result
from northfinder.config import RigConfig
from northfinder.recording import begin
from northfinder.records import Records, Writer
from northfinder.starting import with_start
from northfinder.wiring import build_rig, event_loop


def carry_out(config: RigConfig, plan: BaseModel, database: str | None, *, as_json: bool) -> None:
    """Carry a plan out on the configured rig, in its time, and print the result.

    Raises:
        NorthfinderError: The run failed; the record says so too.
        DriverError: The rig cannot be opened.
    """
    with asyncio.Runner(loop_factory=event_loop(config, AS_FAST_AS_IT_GOES)) as runner:
        result = runner.run(_recorded(config, plan, database_url(database, config)))
    show_result(result, as_json=as_json)


async def _recorded(config: RigConfig, plan: BaseModel, url: str) -> dict[str, Any]:
    with Records.open(url) as store, LiveProgress() as progress:
        async with Writer(store) as writer, build_rig(config) as rig:
            chosen = with_start(plan, store, rig.name)
            run = await begin(rig, chosen, writer, progress.show)
            return await run.carry_out()
