"""A run, visits and samples to record."""

import numpy as np
from sqlalchemy import create_engine, text

from northfinder.records import NewRun, Stream, VisitStatistics
from northfinder.samples import Samples

RUN = NewRun(
    kind="north-seek",
    rig_name="Lab 3",
    plan={"positions": 24, "dwell_s": 5.0, "target_sigma_deg": None},
    prediction={"duration_s": 151.0, "azimuth_sigma_deg": 0.0385},
    site={"latitude_deg": 40.0},
    rig={"gyro": {"driver": "kvh", "link": "sim:", "identity": {"serial_number": "17"}}},
    simulation={"azimuth_deg": 48.0, "seed": 1},
    software={"version": "0.1.0"},
)


def visit(index: int) -> VisitStatistics:
    return VisitStatistics(
        index=index,
        segment=0,
        direction="out",
        angle_rad=index * np.pi / 12,
        gyro_mean_rad_s=5.1e-5 + 0.1 / 3,
        gyro_sigma_rad_s=2.9e-7,
        accel_mean_g=-0.0139,
        accel_sigma_g=6.3e-6,
        samples=4,
        lost=1,
        start_s=7.5 * index,
        turned_rad=None if index == 0 else 0.2618,
    )


def samples(index: int) -> dict[Stream, Samples]:
    tick = np.array([10, 11, 13, 14]) + 20 * index
    return {
        "gyro": Samples(
            tick,
            tick * 1e-3 + 0.1,
            np.array([5e-5, -0.0, np.nan, 5e-324]),
            np.array([True, True, False, True]),
            expected=5,
        ),
        "accelerometer": Samples(
            tick,
            tick * 2e-3,
            np.array([1 / 3, 0.1, 0.2, np.nan]),
            np.array([True] * 3 + [False]),
            expected=4,
        ),
    }


def execute(url: str, statement: str, **values: object) -> None:
    """Change a database behind the records' back."""
    engine = create_engine(url)
    with engine.begin() as connection:
        connection.execute(text(statement), values)
    engine.dispose()
