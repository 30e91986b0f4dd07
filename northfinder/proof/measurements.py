"""How fast this machine does what the instruments and the technician wait for."""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from drivers.codecs.kvh import FrameBlock, KvhDecoder, OutputFormat, encode_frames
from drivers.interfaces import FloatArray
from northfinder.estimators import fit_harmonic
from northfinder.proof.figure import Figure
from northfinder.proof.timing import best_of

_FRAMES = 10_000
_BAUD = 460_800  # of a KVH's line as it leaves the works
_BITS_OF_BYTE = 10  # with start and stop bit
FITS = 100_000
READINGS = 24


def kvh_decoding() -> Iterator[Figure]:
    """Decode KVH format A, CRC checked and every field read."""
    stream = _kvh_stream()
    bulk, live = _frames_per_s(stream, len(stream)), _frames_per_s(stream, len(stream) // 1000)
    wire = _BAUD / _BITS_OF_BYTE / OutputFormat.A.dtype.itemsize
    for name, measured, least in (
        ("10 000-frame buffers", bulk, 1e6),
        ("10-frame chunks", live, 1e5),
    ):
        limit = f"the wire carries {wire:,.0f} frames/s: this is {measured / wire:,.0f} times that"
        yield Figure(f"KVH decode, {name}", measured, "frames/s", least, None, limit)


def harmonic_fit() -> Iterator[Figure]:
    """Fit 100 000 revolutions of 24 at once, against a loop of numpy.linalg.lstsq."""
    batch_s, loop_s = fit_durations_s()
    name = "fit_harmonic (100 000, 24) against a loop of lstsq"
    yield Figure(name, loop_s / batch_s, "times", 100.0, None)


def fit_durations_s() -> tuple[float, float]:
    """Return how long ``FITS`` fits of ``READINGS`` take in one batch, and in a loop of lstsq, s.

    Raises:
        RuntimeError: The two do not find the same.
    """
    angle_rad = np.linspace(0.0, 2 * np.pi, READINGS, endpoint=False)
    rates = np.random.default_rng(1).standard_normal((FITS, READINGS))
    matrix = np.stack([np.ones(READINGS), np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    looped = rates[:4_000]

    def loop() -> list[FloatArray]:
        return [np.linalg.lstsq(matrix, row, rcond=None)[0] for row in looped]

    def batch() -> tuple[FloatArray, ...]:
        fit = fit_harmonic(angle_rad, rates)
        return fit.parameters, fit.covariance, fit.chi2

    if not np.allclose(batch()[0][: len(looped)], loop(), rtol=0.0, atol=1e-12):
        msg = "fit_harmonic and lstsq find different parameters, so their durations say nothing"
        raise RuntimeError(msg)
    return best_of(batch, 7), best_of(loop, 3) * len(rates) / len(looped)


def whole_seek() -> Iterator[Figure]:
    """Run the default north-seek as a user does: process start to exit, records included."""
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder, 'bench.db').as_posix()}"
        command = [sys.executable, "-m", "northfinder", "seek", "--json", "--database", url]
        duration_s = best_of(
            lambda: subprocess.run(command, check=True, capture_output=True),  # noqa: S603 - ours
            repeats=3,
        )
    yield Figure("northfinder seek, whole process", duration_s, "s", None, 6.0)


def _kvh_stream() -> bytes:
    records = np.zeros(_FRAMES, OutputFormat.A.dtype)
    records["gyro"] = np.random.default_rng(1).normal(0.0, 1e-6, (_FRAMES, 3))
    records["acceleration"][:, 2] = 1.0
    records["status"], records["sequence"] = 0x77, np.arange(_FRAMES) % 128
    return encode_frames(FrameBlock(OutputFormat.A, records))


def _frames_per_s(stream: bytes, chunk_bytes: int) -> float:
    chunks = [stream[i : i + chunk_bytes] for i in range(0, len(stream), chunk_bytes)]

    def decode() -> None:
        decoder = KvhDecoder()
        for chunk in chunks:
            decoder.receive_data(chunk)
            while isinstance(block := decoder.next_event(), FrameBlock):
                _ = block.gyro, block.acceleration, block.status, block.sequence, block.temperature

    return _FRAMES / best_of(decode, 10)
