"""Damage of bytes by a seeded generator, and the weight of what a codec keeps of them."""

import pickle

import numpy as np
from numpy.random import Generator

SEED = 1122
_BYTES_PER_HIT = 40


def flipped(data: bytes, random: Generator) -> bytes:
    """Return the same with a bit changed in one byte of forty."""
    raw = np.frombuffer(data, np.uint8)
    hit = random.random(len(raw)) < 1 / _BYTES_PER_HIT
    return bytes(raw ^ np.where(hit, 1 << random.integers(0, 8, len(raw)), 0).astype(np.uint8))


def held_bytes(codec: object) -> int:
    """Return how much a codec keeps, whatever its fields are called."""
    return len(pickle.dumps(codec))
