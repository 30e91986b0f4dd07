"""Recorded runs on the simulated rig, as a certificate is made of them."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from pydantic import BaseModel

from northfinder.config import RigConfig
from northfinder.procedures import alignment, heading_hold, noise
from northfinder.procedures.north_seek import Plan
from northfinder.recording import begin
from northfinder.records import Records, Run, VisitStatistics, Writer
from northfinder.replay import estimates_of
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


SITE: dict[str, Any] = {"name": NAME, "latitude_deg": 40.0, "reference_offset_deg": -132.5}
DATABASE: dict[str, Any] = {"url": f"postgresql+psycopg://lab:{PASSWORD}@somewhere/north"}

Recording = Callable[..., Recorded]


@pytest.fixture(scope="session")
def record(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recording]:
    """Carry a plan out on a simulated rig, in virtual time, and return what the records keep."""
    folder: Path = tmp_path_factory.mktemp("report")
    with Records.open(f"sqlite:///{folder / 'records.db'}") as store:

        def carry_out(plan: BaseModel, **sections: dict[str, Any]) -> Recorded:
            config = config_of(**{"site": SITE, "database": DATABASE, **sections})
            return _kept(store, virtually(config, _run(store, config, plan)))

        yield carry_out


async def _run(store: Records, config: RigConfig, plan: BaseModel) -> str:
    async with Writer(store) as writer, build_rig(config) as rig:
        recorded = await begin(rig, plan, writer, lambda _: None)
        await recorded.carry_out()
        return recorded.id


def _kept(store: Records, run_id: str) -> Recorded:
    return Recorded(
        store.run(run_id),
        store.visits(run_id),
        estimates_of(store, run_id),
        store.samples_sha256(run_id),
    )


@pytest.fixture(scope="session")
def recorded(record: Recording) -> Recorded:
    """A north-seek."""
    return record(Plan(positions=8, dwell_s=0.4, settle_s=0.1))


@pytest.fixture(scope="session")
def aligned(record: Recording) -> Recorded:
    """An alignment in a vehicle that rocks."""
    simulation = {"base": "nominal", "gyro_bias_deg_h": 0.01}
    return record(alignment.Plan(duration_s=40.0), simulation=simulation)


@pytest.fixture(scope="session")
def held(record: Recording) -> Recorded:
    """A heading that was held from a north-seek across north."""
    start = heading_hold.Start(
        run_id="20261122T000000Z-00000a",
        kind="north-seek",
        azimuth_deg=359.9999,
        azimuth_sigma_deg=0.02,
        pitch_deg=0.8,
        roll_deg=-0.5,
        latitude_deg=40.0,
    )
    simulation = {"azimuth_deg": 0.0, "gyro_noise_deg_sqrt_h": 0.01}
    plan = heading_hold.Plan(duration_s=30.0, rest_s=10.0, start=start)
    return record(plan, simulation=simulation)


@pytest.fixture(scope="session")
def silent(record: Recording) -> Recorded:
    """A noise record; seed 1 is the one of twenty whose interval misses the truth."""
    return record(noise.Plan(duration_s=30.0), simulation={"seed": 2})
