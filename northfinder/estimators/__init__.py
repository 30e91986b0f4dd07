"""Pure functions from readings to azimuth: arrays in, frozen results out; no I/O, no clocks."""

from northfinder.estimators.azimuth import solve_azimuth
from northfinder.estimators.harmonic import fit_harmonic
from northfinder.estimators.tilt import estimate_tilt

__all__ = ["estimate_tilt", "fit_harmonic", "solve_azimuth"]
