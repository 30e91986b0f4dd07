"""Products of many quaternions at once, as pairs of complex numbers; a blocked scan.

A quaternion ``w + x i + y j + z k`` is ``a + b j`` with ``a = w + x i`` and ``b = y + z i``: the
product takes four complex multiplications, and a scalar-first row of four floats in memory is
already such a pair.
"""

import numpy as np

from northfinder.attitude.arrays import ComplexArray, FloatArray

Pair = tuple[ComplexArray, ComplexArray]


def pair_product(p: Pair, q: Pair) -> Pair:
    """Hamilton product ``(a1 + b1 j)(a2 + b2 j)``, with ``j a = conj(a) j``; broadcasts."""
    (a1, b1), (a2, b2) = p, q
    return a1 * a2 - b1 * np.conj(b2), a1 * b2 + b1 * np.conj(a2)


def pair_from_parts(w: FloatArray, vector: FloatArray) -> Pair:
    """Return the pair of scalars ``(n,)`` and vectors ``(3, n)``."""
    a, b = np.empty(w.shape, np.complex128), np.empty(w.shape, np.complex128)
    a.real, a.imag = w, vector[0]
    b.real, b.imag = vector[1], vector[2]
    return a, b


def pair_from_rotation_vectors(phi: FloatArray) -> Pair:
    """Return ``exp(Phi / 2)`` of rotation vectors ``(3, n)``, rad."""
    half = 0.5 * np.sqrt(phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2])
    safe = np.where(half > 0.0, half, 1.0)
    factor = np.where(half > 0.0, 0.5 * np.sin(safe) / safe, 0.5)
    return pair_from_parts(np.cos(half), factor * phi)


def cumulative_product(first: Pair, steps: Pair) -> Pair:
    """Return ``first (x) steps[0] (x) ... (x) steps[k]`` for every k.

    The steps stand in rows of about the square root of their number; all rows are multiplied
    through side by side, then their ends by the same means, then each row takes over the end of
    the row before.

    Args:
        first: What the product starts from, of shape ``()``.
        steps: Quaternions as pairs, ``(m,)``.
    """
    m = len(steps[0])
    if m <= 8:
        return _one_by_one(first, steps)
    length = max(2, round(0.7 * m**0.5))
    rows = -(-m // length)
    a, b = (_in_rows(part, rows, length, fill) for part, fill in zip(steps, (1, 0), strict=True))
    _run_along(a, b)
    ends = cumulative_product(first, (a[-1], b[-1]))
    before = tuple(
        np.concatenate(([part], end[:-1])) for part, end in zip(first, ends, strict=True)
    )
    whole = pair_product((before[0], before[1]), (a, b))
    return whole[0].T.ravel()[:m], whole[1].T.ravel()[:m]


def _one_by_one(first: Pair, steps: Pair) -> Pair:
    """Multiply a handful."""
    a, b = np.empty_like(steps[0]), np.empty_like(steps[1])
    now = first
    for k in range(len(a)):
        now = pair_product(now, (steps[0][k], steps[1][k]))
        a[k], b[k] = now
    return a, b


def _in_rows(part: ComplexArray, rows: int, length: int, fill: complex) -> ComplexArray:
    """Return ``part`` with its rows side by side, ``(length, rows)``, the last one filled up."""
    padded = np.full(rows * length, fill, np.complex128)
    padded[: len(part)] = part
    return np.ascontiguousarray(padded.reshape(rows, length).T)


def _run_along(a: ComplexArray, b: ComplexArray) -> None:
    """Turn steps into products along the first axis, in place."""
    for k in range(1, len(a)):
        a[k], b[k] = pair_product((a[k - 1], b[k - 1]), (a[k], b[k]))
