"""People who get on and off a sprung base: their loads, and how the suspension answers.

Every load is a ramp up and a ramp down. Between two corners of the ramps a damped oscillator
moves as a line plus one damped tone, whatever happened before: so each minute is a table of
stretches, worked out once from the loads of the minutes before it, and any time is looked up.
"""

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import FloatArray
from sim.base_settings import People

_MINUTE_S = 60.0
_EPOCH = 2**40  # minutes before zero have seeds too
_KEPT = 64  # minutes
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True, eq=False)
class Loads:
    """Those who arrive in a minute, in the order in which they were drawn.

    Attributes:
        on_s: When each begins to get on, ``(p,)``.
        off_s: When the load begins to go, ``(p,)``.
        going_s: How long it takes to go, ``(p,)``.
        lean: Pitch (rad), roll (rad) and heave (m) under the full load at rest, ``(p, 3)``.
    """

    on_s: FloatArray
    off_s: FloatArray
    going_s: FloatArray
    lean: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Stretches:
    """Line plus damped tone from each start on; ``(s,)``, ``(s, 3)``, ``(s, 3)`` complex."""

    start_s: FloatArray
    offset: FloatArray
    slope: FloatArray
    tone: NDArray[np.complex128]


class Boarding:
    """Pitch, roll and heave of a sprung base under people, at any time.

    Args:
        people: How they come and go.
        seed: Of the process; every minute draws from a stream of its own.
    """

    def __init__(self, people: People, seed: int) -> None:
        self._people, self._seed = people, seed
        omega = np.array([2.0 * math.pi * spring.frequency_hz for spring in people.springs])
        damping = np.array([spring.damping for spring in people.springs])
        damped = omega * np.sqrt(1.0 - damping**2)
        self._pole = -damping * omega + 1j * damped
        # A load that begins to grow as t: x = t - lag + Re(start exp(pole t)), from rest.
        self._lag_s = 2.0 * damping / omega
        self._start = self._lag_s - 1j * (2.0 * damping**2 - 1.0) / damped
        longest_s = people.ramp_s + max(people.fade_s, people.stay_s[1])
        ringing_s = 40.0 / float((damping * omega).min())  # e^-40 is below a double's last bit
        self._history = math.ceil((longest_s + ringing_s) / _MINUTE_S)
        self._loads: dict[int, Loads] = {}
        self._tables: dict[int, _Stretches] = {}

    def loads(self, minute: int) -> Loads:
        """Return those who arrive in a minute, counted from time zero; negative ones too."""
        known = self._loads.get(minute)
        if known is None:
            known = _remember(self._loads, minute, self._draw(minute), _KEPT + self._history)
        return known

    def motion(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return pitch (rad), roll (rad) and heave (m), and two derivatives, ``(k, 3)`` each."""
        table = self._covering(time_s)
        index = np.searchsorted(table.start_s, time_s, side="right") - 1
        after_s = (time_s - table.start_s[index])[:, np.newaxis]
        tone = table.tone[index] * np.exp(self._pole * after_s)
        slope = table.slope[index]
        once = self._pole * tone
        value = table.offset[index] + slope * after_s + tone.real
        return value, slope + once.real, (self._pole * once).real

    def _draw(self, minute: int) -> Loads:
        people, random = self._people, np.random.default_rng((self._seed, minute + _EPOCH))
        count = random.poisson(_MINUTE_S / people.interval_s)
        on_s = _MINUTE_S * (minute + random.uniform(size=count))
        lean = random.standard_normal((count, 3))
        lean *= [people.pitch_rad, people.roll_rad, people.heave_m]
        leaves = random.uniform(size=count) < people.leaving
        stay_s = np.where(leaves, random.uniform(*people.stay_s, size=count), people.ramp_s)
        return Loads(on_s, on_s + stay_s, np.where(leaves, people.ramp_s, people.fade_s), lean)

    def _covering(self, time_s: FloatArray) -> _Stretches:
        first, last = (math.floor(t / _MINUTE_S) for t in (time_s.min(), time_s.max()))
        tables = [self._table(minute) for minute in range(first, last + 1)]
        if len(tables) == 1:
            return tables[0]
        fields = ("start_s", "offset", "slope", "tone")
        return _Stretches(*(np.concatenate([getattr(t, name) for t in tables]) for name in fields))

    def _table(self, minute: int) -> _Stretches:
        known = self._tables.get(minute)
        if known is None:
            known = _remember(self._tables, minute, self._tabulate(minute), _KEPT)
        return known

    def _tabulate(self, minute: int) -> _Stretches:
        """Add up everyone's load, and ring of every corner, at the start of each stretch."""
        before = [self.loads(m) for m in range(minute - self._history, minute + 1)]
        on_s, off_s, going_s = (
            np.concatenate([getattr(loads, name) for loads in before])
            for name in ("on_s", "off_s", "going_s")
        )
        lean = np.concatenate([loads.lean for loads in before])
        ramp_s = np.full_like(on_s, self._people.ramp_s)
        corner_s = np.concatenate([on_s, on_s + ramp_s, off_s, off_s + going_s])
        rise, fall = lean / ramp_s[:, np.newaxis], lean / going_s[:, np.newaxis]
        kink = np.concatenate([rise, -rise, -fall, fall])
        start_s = _MINUTE_S * minute
        inside = corner_s[(corner_s > start_s) & (corner_s < start_s + _MINUTE_S)]
        starts_s = np.concatenate([[start_s], np.sort(inside)])

        def share(since_s: FloatArray, lasting_s: FloatArray) -> FloatArray:
            done: FloatArray = np.clip(np.subtract.outer(starts_s, since_s) / lasting_s, 0.0, 1.0)
            return done

        load = (share(on_s, ramp_s) - share(off_s, going_s)) @ lean
        age_s = np.subtract.outer(starts_s, corner_s)
        begun = age_s >= 0.0
        slope = begun @ kink
        ring = np.exp(np.multiply.outer(np.where(begun, age_s, np.inf), self._pole.real))
        ring = ring * np.exp(1j * np.multiply.outer(np.where(begun, age_s, 0.0), self._pole.imag))
        tone = self._start * np.einsum("scd,cd->sd", ring, kink)
        return _Stretches(starts_s, load - self._lag_s * slope, slope, tone)


def _remember(known: dict[int, _T], minute: int, fresh: _T, most: int) -> _T:
    """Keep the latest that were asked for; a service may run for weeks."""
    known[minute] = fresh
    if len(known) > most:
        del known[next(iter(known))]
    return fresh
