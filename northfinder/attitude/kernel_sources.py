"""What Numba compiles: plain loops over blocks of updates, in the subset of Python that it reads.

A block's steps are worked out first, which the compiler does several at a time; only the product
that runs through them has to go one by one.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from northfinder.attitude.arrays import FloatArray
from northfinder.attitude.rotation_vectors import Scheme

Four = tuple[float, float, float, float]
Compile = Callable[[Callable[..., Any]], Any]

_BLOCK = 256  # updates, whose steps stay in the nearest cache
_SERIES_BELOW = 0.25  # rad^2 of Phi: seven terms err by 1e-19


def scheme_kernel(jit: Compile, scheme: Scheme, behind: int) -> Any:  # noqa: ANN401 (compiled)
    """Return the kernel of a method linear and bilinear in its samples.

    Args:
        jit: Numba's compiler.
        scheme: The method; its coefficients become constants of the compiled code.
        behind: Samples that its window reaches back before an update.
    """
    window, stride, pairs = scheme.window, scheme.stride, len(scheme.crosses)
    total = np.array(scheme.total)
    left = np.array([left for left, _ in scheme.crosses]).reshape(pairs, window)
    right = np.array([right for _, right in scheme.crosses]).reshape(pairs, window)
    exponentiate = jit(_exponentiate)

    def fill(samples: FloatArray, unit: float, first: int, count: int, steps: FloatArray) -> None:
        for k in range(count):
            at = (first + k) * stride - behind
            x, y, z = 0.0, 0.0, 0.0
            for i in range(window):
                x += total[i] * samples[at + i, 0]
                y += total[i] * samples[at + i, 1]
                z += total[i] * samples[at + i, 2]
            for pair in range(pairs):
                u_x, u_y, u_z, v_x, v_y, v_z = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for i in range(window):
                    u_x += left[pair, i] * samples[at + i, 0]
                    u_y += left[pair, i] * samples[at + i, 1]
                    u_z += left[pair, i] * samples[at + i, 2]
                    v_x += right[pair, i] * samples[at + i, 0]
                    v_y += right[pair, i] * samples[at + i, 1]
                    v_z += right[pair, i] * samples[at + i, 2]
                x += unit * (u_y * v_z - u_z * v_y)
                y += unit * (u_z * v_x - u_x * v_z)
                z += unit * (u_x * v_y - u_y * v_x)
            steps[1, k], steps[2, k], steps[3, k] = unit * x, unit * y, unit * z
        exponentiate(steps, count)

    return _kernel(jit, jit(fill))


def rk4_kernel(jit: Compile) -> Any:  # noqa: ANN401 (compiled)
    """Return the kernel of the quaternion Runge-Kutta."""
    slope = jit(_slope)

    def fill(samples: FloatArray, unit: float, first: int, count: int, steps: FloatArray) -> None:
        for k in range(count):
            at = 2 * (first + k)
            x, y, z = unit * samples[at, 0], unit * samples[at, 1], unit * samples[at, 2]
            middle = unit * samples[at + 1, 0], unit * samples[at + 1, 1], unit * samples[at + 1, 2]
            last = unit * samples[at + 2, 0], unit * samples[at + 2, 1], unit * samples[at + 2, 2]
            w2, x2, y2, z2 = slope((1.0, 0.5 * x, 0.5 * y, 0.5 * z), middle)
            w3, x3, y3, z3 = slope((1.0 + 0.5 * w2, 0.5 * x2, 0.5 * y2, 0.5 * z2), middle)
            w4, x4, y4, z4 = slope((1.0 + w3, x3, y3, z3), last)
            w = 1.0 + (2.0 * (w2 + w3) + w4) / 6.0
            x = (x + 2.0 * (x2 + x3) + x4) / 6.0
            y = (y + 2.0 * (y2 + y3) + y4) / 6.0
            z = (z + 2.0 * (z2 + z3) + z4) / 6.0
            shorten = 1.0 / np.sqrt(w * w + x * x + y * y + z * z)
            steps[0, k], steps[1, k] = w * shorten, x * shorten
            steps[2, k], steps[3, k] = y * shorten, z * shorten

    return _kernel(jit, jit(fill))


def _kernel(jit: Compile, fill: Callable[..., None]) -> Any:  # noqa: ANN401 (compiled)
    run_through = jit(_run_through)

    def kernel(
        samples: FloatArray, unit: float, q0: FloatArray, attitude: FloatArray, first: int
    ) -> None:
        steps = np.empty((4, _BLOCK))
        q = q0[0], q0[1], q0[2], q0[3]
        for begin in range(first, len(attitude), _BLOCK):
            block = attitude[begin : begin + _BLOCK]
            fill(samples, unit, begin, len(block), steps)
            q = run_through(q, steps, block)

    return jit(kernel)


def _exponentiate(steps: FloatArray, count: int) -> None:
    """Turn rotation vectors in rows 1 to 3 into ``exp(Phi / 2)``, by series where all are small."""
    largest = 0.0
    for k in range(count):
        x, y, z = steps[1, k], steps[2, k], steps[3, k]
        steps[0, k] = x * x + y * y + z * z
        largest = max(largest, steps[0, k])
    for k in range(count):
        if largest < _SERIES_BELOW:
            t = -0.25 * steps[0, k]
            w, s = 1.0 + t * (1 / 132), 1.0 + t * (1 / 156)
            w, s = 1.0 + t * (1 / 90) * w, 1.0 + t * (1 / 110) * s
            w, s = 1.0 + t * (1 / 56) * w, 1.0 + t * (1 / 72) * s
            w, s = 1.0 + t * (1 / 30) * w, 1.0 + t * (1 / 42) * s
            w, s = 1.0 + t * (1 / 12) * w, 1.0 + t * (1 / 20) * s
            w, s = 1.0 + t * (1 / 2) * w, 0.5 + t * (1 / 12) * s
        else:
            angle = np.sqrt(steps[0, k])
            w, s = np.cos(0.5 * angle), 0.5
            if angle > 0.0:
                s = np.sin(0.5 * angle) / angle
        steps[0, k] = w
        steps[1, k] *= s
        steps[2, k] *= s
        steps[3, k] *= s


def _run_through(q: Four, steps: FloatArray, block: FloatArray) -> Four:
    """Multiply a block's steps one after the other; write and return the normalised product."""
    w, x, y, z = q
    for k in range(len(block)):
        a, b, c, d = steps[0, k], steps[1, k], steps[2, k], steps[3, k]
        w, x, y, z = (
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        )
        unit = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)  # one Newton step, off the chain
        block[k, 0], block[k, 1], block[k, 2], block[k, 3] = w * unit, x * unit, y * unit, z * unit
    return block[-1, 0], block[-1, 1], block[-1, 2], block[-1, 3]


def _slope(q: Four, rate: tuple[float, float, float]) -> Four:
    """Return ``q (x) [0, rate]``."""
    w, x, y, z = q
    b, c, d = rate
    return (
        -x * b - y * c - z * d,
        w * b + y * d - z * c,
        w * c - x * d + z * b,
        w * d + x * c - y * b,
    )
