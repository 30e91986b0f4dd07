"""A recorded north-seek on the simulated rig, as a certificate is made of it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from northfinder.procedures.north_seek import Plan
from northfinder.recording import begin
from northfinder.records import Records, Run, VisitStatistics, Writer
from northfinder.wiring import build_rig
from tests.procedures.rigs import config_of, virtually

PASSWORD = "hunter2"  # noqa: S105 -- to be found nowhere
NAME = "<script>alert('north & \"south\"')</script> $x_1$"


class Recorded(NamedTuple):
    run: Run
    visits: list[VisitStatistics]
    estimates: list[dict[str, Any]]
    samples_sha256: str

    @property
    def result(self) -> dict[str, Any]:
        assert self.run.result is not None
        return self.run.result


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recorded]:
    folder: Path = tmp_path_factory.mktemp("report")
    plan = Plan(positions=8, dwell_s=0.4, settle_s=0.1)
    config = config_of(
        site={"name": NAME, "latitude_deg": 40.0, "reference_offset_deg": -132.5},
        database={"url": f"postgresql+psycopg://lab:{PASSWORD}@somewhere/north"},
    )

    async def seek(store: Records) -> str:
        async with Writer(store) as writer, build_rig(config) as rig:
            recorded = await begin(rig, plan, writer, lambda _: None)
            await recorded.carry_out()
            return recorded.id

    with Records.open(f"sqlite:///{folder / 'records.db'}") as store:
        run_id = virtually(config, seek(store))
        events = store.events(run_id)
        yield Recorded(
            store.run(run_id),
            store.visits(run_id),
            [event.data for event in events if event.event == "estimate"],
            store.samples_sha256(run_id),
        )
