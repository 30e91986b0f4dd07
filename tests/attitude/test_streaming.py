"""A stream of increments turns the attitude as all of them at once do."""

import numpy as np
import pytest

from northfinder.attitude import ConingMotion, integrate
from northfinder.attitude.quaternion import conjugate, multiply, to_rotation_vector
from northfinder.attitude.streaming import INCREMENT_METHODS, AttitudeStream, IncrementMethod

CONE = ConingMotion(0.02, 50.0)
TURNS = np.add(CONE.increments(0.005 * np.arange(241.0)), [0.0, 0.0, 1e-3])  # 1 to 4 divide 240


@pytest.mark.parametrize("method", INCREMENT_METHODS)
@pytest.mark.parametrize("cuts", [(), (1, 2, 3), (7, 100, 101), tuple(range(5, 240, 5))])
def test_chunks_change_nothing(method: IncrementMethod, cuts: tuple[int, ...]) -> None:
    stream = AttitudeStream(method)
    for chunk in np.split(TURNS, list(cuts)):
        stream.add(chunk)
    whole = integrate(TURNS, 1.0, method, kind="increments")[-1]
    apart = to_rotation_vector(multiply(conjugate(whole), stream.attitude))
    assert np.linalg.norm(apart) < 1e-14


def test_what_fills_no_update_waits() -> None:
    stream = AttitudeStream("four-sample", (0.6, 0.8, 0.0, 0.0))
    stream.add(TURNS[:3])
    assert stream.attitude == pytest.approx([0.6, 0.8, 0.0, 0.0])


def test_rates_have_no_place_here() -> None:
    with pytest.raises(ValueError, match="unknown method 'rk4'"):
        AttitudeStream("rk4")  # type: ignore[arg-type]
