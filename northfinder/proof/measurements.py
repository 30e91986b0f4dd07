"""How fast this machine does what the instruments and the technician wait for."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from drivers.codecs.kvh import FrameBlock, KvhDecoder, OutputFormat, encode_frames
from northfinder.estimators import fit_harmonic
from northfinder.proof.figure import Figure

_FRAMES = 10_000


def kvh_decoding() -> Iterator[Figure]:
    """Decode KVH format A, CRC checked and every field read."""
    stream = _kvh_stream()
    bulk, live = _frames_per_s(stream, len(stream)), _frames_per_s(stream, len(stream) // 1000)
    yield Figure("KVH decode, 10 000-frame buffers", bulk, "frames/s", 1e6, None)
    yield Figure("KVH decode, 10-frame chunks", live, "frames/s", 1e5, None)


def harmonic_fit() -> Iterator[Figure]:
    """Fit 100 000 revolutions of 24 at once, against a loop of numpy.linalg.lstsq."""
    angle_rad = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    rates = np.random.default_rng(1).standard_normal((100_000, 24))
    matrix = np.stack([np.ones(24), np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    looped = rates[:4_000]

    def loop() -> list[object]:
        return [np.linalg.lstsq(matrix, row, rcond=None) for row in looped]

    def batch() -> tuple[object, ...]:
        fit = fit_harmonic(angle_rad, rates)
        return fit.parameters, fit.covariance, fit.chi2

    batch_s = _best_of(batch, 7)
    loop_s = _best_of(loop, 3) * len(rates) / len(looped)
    name = "fit_harmonic (100 000, 24) against a loop of lstsq"
    yield Figure(name, loop_s / batch_s, "times", 100.0, None)


def whole_seek() -> Iterator[Figure]:
    """Run the default north-seek as a user does: process start to exit, records included."""
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder, 'bench.db').as_posix()}"
        command = [sys.executable, "-m", "northfinder", "seek", "--json", "--database", url]
        duration_s = _best_of(
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

    return _FRAMES / _best_of(decode, 10)


def _best_of(job: Callable[[], object], repeats: int) -> float:
    """Return the least of several durations in s: whatever disturbs one only adds to it."""
    durations_s = []
    for _ in range(repeats):
        start_s = time.perf_counter()
        job()
        durations_s.append(time.perf_counter() - start_s)
    return min(durations_s)
