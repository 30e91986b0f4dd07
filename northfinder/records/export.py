"""A run's samples and visits as files: CSV for people, Parquet for programs; angles in degrees.

One row per sample, of both streams. A column has one unit and its name says which, so that each
stream has a value column of its own, empty in the other's rows; a sample for which the device
sent no value has neither.
"""

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields

from northfinder.records.arrow import csv, pa, parquet
from northfinder.records.entries import RunSummary, VisitStatistics
from northfinder.records.portable_json import JsonObject
from northfinder.records.store import Records
from northfinder.samples import STREAMS, Samples, Stream
from northfinder.units import DEG, DEG_PER_HOUR

_COLUMNS: dict[str, pa.DataType] = {
    "visit": pa.int32(),
    "segment": pa.int32(),
    "direction": pa.string(),
    "angle_deg": pa.float64(),
    "stream": pa.string(),
    "tick": pa.int64(),
    "time_s": pa.float64(),
    "valid": pa.bool_(),
    "rate_deg_h": pa.float64(),
    "force_g": pa.float64(),
}
_SCHEMA = pa.schema(_COLUMNS)


def samples_csv(records: Records, run_id: str) -> Iterator[bytes]:
    """Return a run's raw samples as CSV, piece by piece, a visit each.

    Columns: visit, segment, direction, angle_deg, stream, tick (the device's own count), time_s
    (by the clock of the program that measured, from its start), valid, rate_deg_h, force_g.

    Raises:
        RecordsError: No such run; while iterating: damaged samples, or the database is gone.
    """
    return _csv(_SCHEMA.names, _visit_tables(records, run_id))


def samples_parquet(records: Records, run_id: str) -> Iterator[bytes]:
    """Return a run's raw samples as Parquet, piece by piece: a row group per visit.

    Columns as in :func:`samples_csv`; the file's metadata has ``run_id`` and ``samples_sha256``,
    which the certificate prints too.

    Raises:
        RecordsError: As :func:`samples_csv`.
    """
    run = records.run(run_id)
    metadata = {"run_id": run.id, "samples_sha256": records.samples_sha256(run.id)}
    return _parquet(_SCHEMA.with_metadata(metadata), _visit_tables(records, run.id))


def visits_csv(records: Records, run_id: str) -> Iterator[bytes]:
    """Return a run's visits as CSV; the columns are the keys of :func:`visit_json`.

    Raises:
        RecordsError: No such run.
    """
    rows = [visit_json(visit) for visit in records.visits(run_id)]
    names = [_VISIT_KEYS.get(field.name, field.name) for field in fields(VisitStatistics)]
    columns = {name: [row[name] for row in rows] for name in names}
    return _csv(names, iter([pa.table(columns)] if rows else []))


def visit_json(visit: VisitStatistics) -> JsonObject:
    """Return a visit as results and events show it, in degrees."""
    shown: JsonObject = {}
    for field in fields(visit):
        value = getattr(visit, field.name)
        key = _VISIT_KEYS.get(field.name, field.name)
        unit = DEG_PER_HOUR if key.endswith("_deg_h") else DEG if key.endswith("_deg") else None
        shown[key] = value if unit is None or value is None else value / unit
    return shown


_VISIT_KEYS = {
    "angle_rad": "angle_deg",
    "gyro_mean_rad_s": "gyro_mean_deg_h",
    "gyro_sigma_rad_s": "gyro_sigma_deg_h",
    "turned_rad": "turned_deg",
}


def file_name(run: RunSummary, part: str, suffix: str) -> str:
    """Return a name for a download: ``northfinder-20261122T034512Z-7f3a9c-samples.csv``."""
    return f"northfinder-{run.id}-{part}.{suffix}"


def _visit_tables(records: Records, run_id: str) -> Iterator[pa.Table]:
    visits = records.visits(run_id)  # now: an unknown run shall not be found out in mid-answer
    return (_table(visit, records.samples(run_id, visit.index)) for visit in visits)


def _table(visit: VisitStatistics, samples: Mapping[Stream, Samples]) -> pa.Table:
    parts = [_stream_table(visit, name, samples[name]) for name in STREAMS if name in samples]
    # One chunk: before an empty one, of a stream that lost everything, write_csv of pyarrow 26
    # writes whatever stands in its memory.
    return pa.concat_tables([_SCHEMA.empty_table(), *parts]).combine_chunks()


def _stream_table(visit: VisitStatistics, stream: Stream, samples: Samples) -> pa.Table:
    count = len(samples)
    nothing = pa.nulls(count, pa.float64())
    is_rate = stream == "gyro" or stream.startswith("rate")
    unit = DEG_PER_HOUR if is_rate else 1.0
    values = pa.array(samples.value / unit, from_pandas=True)  # NaN, no value was sent: null
    constants = (visit.index, visit.segment, visit.direction, visit.angle_rad / DEG, stream)
    columns = [
        *(pa.repeat(constant, count) for constant in constants),
        pa.array(samples.tick),
        pa.array(samples.time_s),
        pa.array(samples.valid),
        values if is_rate else nothing,
        nothing if is_rate else values,
    ]
    return pa.Table.from_arrays(columns, names=_SCHEMA.names).cast(_SCHEMA)


def _csv(names: Sequence[str], tables: Iterator[pa.Table]) -> Iterator[bytes]:
    yield (",".join(names) + "\n").encode()
    options = csv.WriteOptions(include_header=False, quoting_style="none")
    for table in tables:
        if table.num_rows == 0:
            continue
        sink = pa.BufferOutputStream()
        csv.write_csv(table, sink, options)
        yield sink.getvalue().to_pybytes()


def _parquet(schema: pa.Schema, tables: Iterator[pa.Table]) -> Iterator[bytes]:
    sink = _Drain()
    with parquet.ParquetWriter(sink, schema, compression="zstd") as writer:
        for table in tables:
            writer.write_table(table, row_group_size=max(1, table.num_rows))
            yield sink.drained()
    yield sink.drained()


class _Drain(io.BytesIO):
    """A file that hands on what is written to it, and keeps none of it."""

    def __init__(self) -> None:
        super().__init__()
        self._handed_on = 0

    def tell(self) -> int:
        """Return how much has been written in all."""
        return self._handed_on + super().tell()

    def drained(self) -> bytes:
        """Return what was written since the last time."""
        piece = self.getvalue()
        self.seek(0)
        self.truncate()
        self._handed_on += len(piece)
        return piece
