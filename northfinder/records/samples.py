"""Raw samples of one stream as Arrow IPC: the identical float64 comes back, NaN included."""

from northfinder.records.arrow import pa
from northfinder.samples import Samples

_COLUMNS: dict[str, pa.DataType] = {
    "tick": pa.int64(),
    "time_s": pa.float64(),
    "value": pa.float64(),
    "valid": pa.bool_(),
}
_SCHEMA = pa.schema(_COLUMNS)
_EXPECTED = b"expected"  # how many samples the dwell should have brought, in the metadata
_OPTIONS = pa.ipc.IpcWriteOptions(compression="zstd")


def encode_samples(samples: Samples) -> bytes:
    """Encode as an Arrow IPC stream of one record batch, compressed with zstd."""
    columns = (samples.tick, samples.time_s, samples.value, samples.valid)
    schema = _SCHEMA.with_metadata({_EXPECTED: str(samples.expected)})
    arrays = [pa.array(column, field.type) for column, field in zip(columns, schema, strict=True)]
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, schema, options=_OPTIONS) as writer:
        writer.write_batch(pa.RecordBatch.from_arrays(arrays, schema=schema))
    return sink.getvalue().to_pybytes()


def decode_samples(blob: bytes) -> Samples:
    """Decode what :func:`encode_samples` wrote; the arrays are read-only."""
    with pa.ipc.open_stream(blob) as reader:
        expected = int(reader.schema.metadata[_EXPECTED])
        batch = reader.read_next_batch()
    tick, time_s, value, valid = (column.to_numpy(zero_copy_only=False) for column in batch.columns)
    return Samples(tick, time_s, value, valid, expected)
