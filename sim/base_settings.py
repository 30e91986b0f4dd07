"""What a rocking base does, number by number: the situation of `rocking-base` and a milder one.

A vehicle with its engine on, people getting on and off, wind or swell moving it as a whole.
"""

import math
from dataclasses import dataclass, replace

from sim.truth import Truth

DEG = math.pi / 180.0
ARCSEC = DEG / 3600.0
STANDARD_GRAVITY_M_S2 = 9.80665


@dataclass(frozen=True, slots=True)
class Swing:
    """A tone of one attitude angle; amplitude and frequency scatter by +-10 % with the seed."""

    amplitude_rad: float
    frequency_hz: float


@dataclass(frozen=True, slots=True)
class EngineOrder:
    """One tone of the engine, on each of the three axes with a phase of its own.

    Attributes:
        frequency_hz: Of the tone.
        acceleration_m_s2: Amplitude of the base's acceleration along each axis of n.
        angle_rad: Amplitude of each attitude angle.
    """

    frequency_hz: float
    acceleration_m_s2: float
    angle_rad: float


@dataclass(frozen=True, slots=True)
class Spring:
    """A second-order suspension; the damping ratio is below 1."""

    frequency_hz: float
    damping: float


@dataclass(frozen=True, slots=True)
class People:
    """Loads that come and go, each with a lean of its own, on the suspension.

    Those who stay would let the lean walk away without bound, 1.2 deg of roll in an hour: so the
    lean of each fades, as slowly as nobody who aligns for two minutes can tell from staying.

    Attributes:
        interval_s: Mean time between arrivals, a Poisson process.
        ramp_s: How long it takes to get on or off.
        leaving: Share of those who get off again.
        stay_s: Shortest and longest time that these stay, uniform.
        fade_s: How long the lean of the others takes to fade, linearly.
        pitch_rad: Lean of each, 1 sigma.
        roll_rad: Lean of each, 1 sigma.
        heave_m: Lift of each, 1 sigma.
        springs: Of pitch, roll and heave.
    """

    interval_s: float = 12.0
    ramp_s: float = 0.6
    leaving: float = 0.5
    stay_s: tuple[float, float] = (2.0, 10.0)
    fade_s: float = 1200.0
    pitch_rad: float = 0.05 * DEG
    roll_rad: float = 0.10 * DEG
    heave_m: float = 2e-3
    springs: tuple[Spring, Spring, Spring] = (
        Spring(1.5, 0.22),
        Spring(1.3, 0.20),
        Spring(1.4, 0.25),
    )

    def __post_init__(self) -> None:
        """Refuse loads that no suspension could answer."""
        shortest_s = min(self.interval_s, self.ramp_s, self.stay_s[0], self.fade_s)
        if not shortest_s > 0.0 or self.stay_s[1] < self.stay_s[0] or self.ramp_s > self.stay_s[0]:
            msg = (
                f"people's times must be positive and nobody leaves before having got on; got "
                f"interval_s {self.interval_s:g}, ramp_s {self.ramp_s:g}, stay_s {self.stay_s}, "
                f"fade_s {self.fade_s:g}"
            )
            raise ValueError(msg)
        if not all(
            0.0 < spring.damping < 1.0 and spring.frequency_hz > 0.0 for spring in self.springs
        ):
            msg = (
                f"a suspension needs a frequency above 0 Hz and a damping ratio between 0 and 1; "
                f"got {self.springs}"
            )
            raise ValueError(msg)


@dataclass(frozen=True, slots=True)
class RockingSettings:
    """A base on the turning Earth; b is right-front-up, n East-North-Up.

    The attitude is ZXY: ``C_b_n = R_z(yaw) R_x(pitch) R_y(roll)``, yaw counter-clockwise.

    Attributes:
        latitude_rad: Geodetic, positive north.
        seed: Equal settings with equal seeds move alike.
        sway_rms_g: Horizontal acceleration along East and along North, standard gravities.
        sway_band_hz: Where its six tones an axis lie.
        yaw_rad: At rest.
        pitch_rad: At rest.
        roll_rad: At rest.
        yaw: The swing of each angle.
        pitch: As yaw.
        roll: As yaw.
        people: None where nobody gets on.
        engine: Its tones.
        lever_arm_m: From the point that the base turns about to the sensors, in b.
        gravity_m_s2: Local gravity; that of ``Truth`` at this latitude where not given.
    """

    latitude_rad: float
    seed: int
    sway_rms_g: float
    sway_band_hz: tuple[float, float]
    yaw_rad: float = 35.0 * DEG
    pitch_rad: float = 1.2 * DEG
    roll_rad: float = -0.8 * DEG
    yaw: Swing = Swing(0.02 * DEG, 0.13)
    pitch: Swing = Swing(0.03 * DEG, 0.21)
    roll: Swing = Swing(0.05 * DEG, 0.17)
    people: People | None = People()
    engine: tuple[EngineOrder, ...] = (
        EngineOrder(23.0, 0.10, 4.0 * ARCSEC),
        EngineOrder(11.5, 0.05, 3.0 * ARCSEC),
    )
    lever_arm_m: tuple[float, float, float] = (0.3, 0.9, 0.8)
    gravity_m_s2: float | None = None

    def __post_init__(self) -> None:
        """Refuse what no base on Earth could do."""
        if not abs(self.latitude_rad) <= math.pi / 2:
            msg = f"the latitude must lie within +-pi/2 rad, got {self.latitude_rad:g}; convert deg"
            raise ValueError(msg)
        low_hz, high_hz = self.sway_band_hz
        if not (0.0 < low_hz <= high_hz < math.inf and 0.0 <= self.sway_rms_g < math.inf):
            msg = (
                f"the sway needs a band above 0 Hz, lower end first, and no negative strength; "
                f"got {self.sway_band_hz} Hz, {self.sway_rms_g:g} g"
            )
            raise ValueError(msg)
        places = (self.yaw_rad, self.pitch_rad, self.roll_rad, *self.lever_arm_m)
        if not all(map(math.isfinite, places)):
            msg = f"the attitude at rest and the lever arm must be finite numbers, got {places}"
            raise ValueError(msg)
        if self.seed < 0:
            msg = f"a seed must not be negative, got {self.seed}"
            raise ValueError(msg)

    def gravity(self) -> float:
        """Return local gravity, m/s^2."""
        return Truth(self.latitude_rad, 0.0, 0.0, 0.0, gravity_m_s2=self.gravity_m_s2).gravity()

    def standing_at(self, truth: Truth) -> "RockingSettings":
        """Return the same motion about a bench's resting attitude, at its place and gravity.

        The bench's table axes at angle zero are then b: the azimuth is clockwise, yaw is not.
        """
        return replace(
            self,
            latitude_rad=truth.latitude_rad,
            yaw_rad=-truth.azimuth_rad,
            pitch_rad=truth.pitch_rad,
            roll_rad=truth.roll_rad,
            gravity_m_s2=truth.gravity(),
        )


def nominal(latitude_rad: float, seed: int) -> RockingSettings:
    """Return a vehicle in light wind: 2e-4 g of horizontal sway at 0.1-0.3 Hz."""
    return RockingSettings(latitude_rad, seed, sway_rms_g=2e-4, sway_band_hz=(0.1, 0.3))


def paper_like(latitude_rad: float, seed: int) -> RockingSettings:
    """Return what it takes to see the paper's errors: 1.2e-3 g of sway at 0.1-0.2 Hz."""
    return RockingSettings(latitude_rad, seed, sway_rms_g=1.2e-3, sway_band_hz=(0.1, 0.2))
