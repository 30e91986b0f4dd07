"""The compiled methods give what the others give."""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from northfinder.attitude import integrate, kernels
from northfinder.attitude.kernel_sources import rk4_kernel, scheme_kernel
from northfinder.attitude.kernels import COMPILED, integrate_compiled
from northfinder.attitude.rotation_vectors import SCHEMES, Kind

NEEDS_INCREMENTS = {name for name, scheme in SCHEMES.items() if scheme.kind == "increments"}


def uncompiled(function: Callable[..., Any]) -> Callable[..., Any]:
    return function


@pytest.mark.parametrize("method", COMPILED)
@pytest.mark.parametrize("scale", [1e-9, 0.02, 0.6])
def test_a_compiled_method_agrees_to_the_last_digits(method: str, scale: float) -> None:
    random = np.random.default_rng(8)
    samples = random.normal(scale=scale, size=(2003, 3)) / 0.01
    q0 = random.normal(size=4)
    options: dict[str, Any] = {"q0": q0 / np.linalg.norm(q0)}
    if method in NEEDS_INCREMENTS:
        samples, options["kind"] = 0.01 * samples, "increments"
    compiled = integrate_compiled(samples, 0.01, method, **options)
    assert_allclose(compiled, integrate(samples, 0.01, method, **options), rtol=0.0, atol=1e-14)


def test_the_options_reach_the_compiled_methods() -> None:
    rates = np.random.default_rng(9).normal(size=(300, 3))
    for method, options in (
        ("picard", {"alpha": 1.1, "beta": 0.25}),
        ("two-sample", {"extraction": "quadratic"}),
        ("trailing-3", {"extraction": "cubic"}),
    ):
        plain = integrate(rates, 0.01, method, **options)
        compiled = integrate_compiled(rates, 0.01, method, **options)
        assert_allclose(compiled, plain, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("count", [1, 2, 4, 5])
def test_fewer_increments_than_the_method_looks_back_at_are_enough(count: int) -> None:
    d = np.random.default_rng(10).normal(scale=0.1, size=(count, 3))
    compiled = integrate_compiled(d, 0.01, "trailing-4", kind="increments")
    plain = integrate(d, 0.01, "trailing-4", kind="increments")
    assert_allclose(compiled, plain, rtol=0.0, atol=1e-15)


def test_what_cannot_be_integrated_is_refused_alike() -> None:
    with pytest.raises(ValueError, match="unknown compiled method 'functional'"):
        integrate_compiled(np.zeros((9, 3)), 0.01, "functional")
    with pytest.raises(ValueError, match="sample 3 holds nan on axis 0"):
        integrate_compiled(np.r_[np.zeros((3, 3)), np.full((1, 3), np.nan)], 0.01)
    with pytest.raises(ValueError, match="at least 3 rates"):
        integrate_compiled(np.zeros((2, 3)), 0.01)


@pytest.mark.parametrize("method", ["three-sample", "one-sample", "rk4"])
@pytest.mark.parametrize("scale", [0.0, 0.02, 1.0])
def test_what_is_compiled_is_right_as_plain_python_too(method: str, scale: float) -> None:
    random = np.random.default_rng(12)
    samples = random.normal(scale=scale, size=(901, 3))
    samples[6:9] = 0.0
    kind: Kind = "rates" if method == "rk4" else "increments"
    expected = integrate(samples, 1.0, method, kind=kind)
    plain = rk4_kernel(uncompiled)
    if method != "rk4":
        plain = scheme_kernel(uncompiled, SCHEMES[method], 0)
    found = np.empty_like(expected)
    plain(samples, 1.0, np.array([1.0, 0.0, 0.0, 0.0]), found, 0)
    assert_allclose(found, expected, rtol=0.0, atol=2e-14)


def test_without_numba_one_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    kernels._kernel.cache_clear()
    with pytest.raises(
        ModuleNotFoundError, match=r"needs Numba: pip install 'northfinder\[fast\]'"
    ):
        integrate_compiled(np.zeros((9, 3)), 0.01)
