"""A run as files, read back by the readers that people use."""

import csv
import hashlib
import io
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from pyarrow import parquet

from northfinder.records import Records, RecordsError, Stream, UnknownRunError
from northfinder.records.export import (
    file_name,
    samples_csv,
    samples_parquet,
    visit_json,
    visits_csv,
)
from northfinder.records.samples import encode_samples
from northfinder.samples import Samples
from tests.records.examples import execute, samples, visit


def rows_of(pieces: list[bytes]) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(b"".join(pieces).decode("ascii"))))


@pytest.fixture
def measured(records: Records, running: str) -> str:
    for index in range(3):
        records.add_visit(running, visit(index), samples(index), {}, 0.1)
    return running


def test_every_sample_is_a_row_and_each_unit_a_column(records: Records, measured: str) -> None:
    pieces = list(samples_csv(records, measured))
    assert len(pieces) == 1 + 3  # a visit at a time
    rows = rows_of(pieces)
    assert len(rows) == 3 * (4 + 4)
    assert rows[8] == {
        "visit": "1",
        "segment": "0",
        "direction": "out",
        "angle_deg": repr(math.degrees(math.pi / 12)),
        "stream": "gyro",
        "tick": "30",
        "time_s": "0.13",
        "valid": "true",
        "rate_deg_h": repr(math.degrees(5e-5) * 3600.0),
        "force_g": "",
    }
    no_value = rows[10]
    assert (no_value["tick"], no_value["valid"], no_value["rate_deg_h"]) == ("33", "false", "")
    force = rows[12]
    assert (force["stream"], force["rate_deg_h"]) == ("accelerometer", "")
    assert float(force["force_g"]) == 1 / 3


def test_parquet_has_the_same_rows_a_group_per_visit(records: Records, measured: str) -> None:
    file = parquet.ParquetFile(io.BytesIO(b"".join(samples_parquet(records, measured))))
    assert file.num_row_groups == 3
    metadata = file.schema_arrow.metadata
    assert metadata[b"run_id"].decode() == measured
    assert metadata[b"samples_sha256"].decode() == records.samples_sha256(measured)
    table = file.read()
    rows = rows_of(list(samples_csv(records, measured)))
    assert table.column_names == list(rows[0])
    for name in ("angle_deg", "time_s", "rate_deg_h", "force_g"):
        values = [float(row[name]) if row[name] else None for row in rows]
        assert table.column(name).to_pylist() == values
    assert table.column("tick").to_pylist() == [int(row["tick"]) for row in rows]


def test_a_stream_that_lost_everything_leaves_no_rows(records: Records, running: str) -> None:
    nothing = Samples(np.array([], np.int64), np.array([]), np.array([]), np.array([], np.bool_), 5)
    for index, lost in enumerate[Stream](("gyro", "accelerometer")):
        kept = {**samples(index), lost: nothing}
        records.add_visit(running, visit(index), kept, {}, 0.1)
    records.add_visit(running, visit(2), {"gyro": nothing, "accelerometer": nothing}, {}, 0.1)
    rows = rows_of(list(samples_csv(records, running)))
    assert [(row["visit"], row["stream"]) for row in rows] == [
        *[("0", "accelerometer")] * 4,
        *[("1", "gyro")] * 4,
    ]
    whole = parquet.read_table(io.BytesIO(b"".join(samples_parquet(records, running))))
    assert whole.num_rows == 8


def test_visits_are_rows_in_degrees(records: Records, running: str) -> None:
    again = replace(visit(1), segment=1, repeats=0)
    for entry in (visit(0), again):
        records.add_visit(running, entry, samples(entry.index), {}, 0.1)
    first, second = rows_of(list(visits_csv(records, running)))
    assert (first["index"], first["turned_deg"], first["repeats"]) == ("0", "", "")
    assert (second["segment"], second["repeats"]) == ("1", "0")
    assert float(second["angle_deg"]) == pytest.approx(15.0)
    assert float(second["turned_deg"]) == pytest.approx(15.0, abs=1e-3)
    # 1 rad/s = 180/pi * 3600 deg/h
    assert float(second["gyro_mean_deg_h"]) == pytest.approx(206264.80625 * again.gyro_mean_rad_s)
    assert list(second) == list(visit_json(again))


def test_a_run_without_visits_is_a_heading(records: Records, running: str) -> None:
    assert rows_of(list(samples_csv(records, running))) == []
    assert rows_of(list(visits_csv(records, running))) == []
    empty = parquet.read_table(io.BytesIO(b"".join(samples_parquet(records, running))))
    assert empty.num_rows == 0


@pytest.mark.parametrize("export", [samples_csv, samples_parquet, visits_csv])
def test_an_unknown_run_is_found_out_before_the_first_byte(
    records: Records, export: Callable[[Records, str], Iterator[bytes]]
) -> None:
    with pytest.raises(UnknownRunError):
        export(records, "20261122T034512Z-7f3a9c")


def test_damaged_samples_are_not_exported(records: Records, measured: str, url: str) -> None:
    execute(url, "UPDATE samples SET arrow = :other WHERE visit_index = 1", other=b"0")
    pieces = samples_csv(records, measured)
    assert [next(pieces) for _ in range(2)]
    with pytest.raises(RecordsError, match="visit 1 are damaged"):
        next(pieces)


def test_the_hash_of_all_samples_is_that_of_their_hashes_in_order(
    records: Records, measured: str
) -> None:
    lines = [
        f"{index} {stream} {hashlib.sha256(encode_samples(part)).hexdigest()}\n"
        for index in range(3)
        for stream, part in sorted(samples(index).items())
    ]
    assert records.samples_sha256(measured) == hashlib.sha256("".join(lines).encode()).hexdigest()


def test_a_file_has_a_name_that_is_safe_everywhere(records: Records, measured: str) -> None:
    name = file_name(records.run(measured), "samples", "csv")
    assert name == f"northfinder-{measured}-samples.csv"
    assert set(name) <= set("abcdefghijklmnopqrstuvwxyzTZ0123456789-.")


def test_a_run_of_180_000_samples_is_exported_in_no_time(records: Records, running: str) -> None:
    """48 visits of 2.5 s at 1 kHz and 500 Hz; 0.2 s on one core, within a generous limit."""
    rng = np.random.default_rng(1)
    for index in range(48):
        parts: dict[Stream, Samples] = {}
        for stream, rate_hz in (("gyro", 1000), ("accelerometer", 500)):
            tick = np.arange(int(2.5 * rate_hz)) + 10_000 * index
            value = rng.normal(scale=1e-4, size=len(tick))
            valid = np.ones(len(tick), np.bool_)
            parts["gyro" if stream == "gyro" else "accelerometer"] = Samples(
                tick, tick / rate_hz, value, valid, len(tick)
            )
        records.add_visit(running, visit(index), parts, {}, 0.1)
    began_s = time.process_time()
    lines = sum(piece.count(b"\n") for piece in samples_csv(records, running))
    assert time.process_time() - began_s < 2.0
    assert lines == 180_001
