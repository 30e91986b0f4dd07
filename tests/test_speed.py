"""Durations compared within one run; `make proof` asserts the absolute figures."""

import struct
import time
from collections.abc import Callable

import numpy as np
import pytest

from drivers.codecs.crc import crc32_mpeg2
from drivers.codecs.kvh import FrameBlock, KvhDecoder, OutputFormat, encode_frames
from northfinder.proof.measurements import harmonic_fit

pytestmark = pytest.mark.alone


def best_s(job: Callable[[], object]) -> float:
    def once() -> float:
        start_s = time.perf_counter()
        job()
        return time.perf_counter() - start_s

    return min(once() for _ in range(7))


def test_fitting_in_one_batch_is_a_hundred_times_as_fast_as_a_loop_of_lstsq() -> None:
    (figure,) = harmonic_fit()
    assert figure.met, figure


def test_decoding_a_log_is_faster_than_unpacking_it_frame_by_frame() -> None:
    records = np.zeros(10_000, OutputFormat.A.dtype)
    records["sequence"] = np.arange(10_000) % 128
    stream = encode_frames(FrameBlock(OutputFormat.A, records))
    frame = struct.Struct(">I6fBBhI")

    def one_by_one() -> None:
        rows = []
        for start in range(0, len(stream), frame.size):
            raw = stream[start : start + frame.size]
            fields = frame.unpack(raw)
            assert crc32_mpeg2(raw[:-4]) == fields[-1]
            rows.append(fields)
        assert np.array(rows).shape == (10_000, 11)

    def decoded() -> None:
        decoder = KvhDecoder()
        decoder.receive_data(stream)
        block = decoder.next_event()
        assert isinstance(block, FrameBlock)
        assert len(block.gyro) == len(block.acceleration) == len(block.sequence) == 10_000

    assert best_s(one_by_one) > 1.5 * best_s(decoded)
