"""Samples survive storage bit for bit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from northfinder.records.samples import decode_samples, encode_samples
from northfinder.samples import Samples


@st.composite
def any_samples(draw: st.DrawFn) -> Samples:
    count = draw(st.integers(0, 40))
    bits = hnp.arrays(np.uint64, count)  # every float64 there is, NaN payloads and -0.0 too
    return Samples(
        tick=draw(hnp.arrays(np.int64, count)),
        time_s=draw(bits).view(np.float64),
        value=draw(bits).view(np.float64),
        valid=draw(hnp.arrays(np.bool_, count)),
        expected=draw(st.integers(count, 100)),
    )


@given(any_samples())
def test_the_identical_bits_come_back(samples: Samples) -> None:
    back = decode_samples(encode_samples(samples))
    assert (len(back), back.expected) == (len(samples), samples.expected)
    for name in ("tick", "time_s", "value", "valid"):
        sent, got = getattr(samples, name), getattr(back, name)
        assert got.dtype == sent.dtype
        assert got.tobytes() == sent.tobytes()


def test_columns_of_a_larger_array_are_stored_as_well() -> None:
    rates = np.arange(12.0).reshape(4, 3)
    samples = Samples(
        np.arange(4), np.arange(4.0), rates[:, 1], np.full((4, 3), fill_value=True)[:, 0], 4
    )
    assert decode_samples(encode_samples(samples)).value.tolist() == [1.0, 4.0, 7.0, 10.0]


@pytest.mark.parametrize("value", [np.zeros(3), np.zeros((4, 3)), np.zeros(())])
def test_columns_that_differ_in_length_are_refused(value: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"all must be \(k,\)"):
        Samples(np.arange(4), np.zeros(4), value, np.zeros(4, dtype=bool), 4)
