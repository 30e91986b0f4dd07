"""Attitude from gyro samples: pure functions, arrays in, quaternions out; no I/O, no clocks."""

from northfinder.attitude.coning import ConingMotion, coning_drift_rad_s
from northfinder.attitude.extraction import extract_increments
from northfinder.attitude.integrate import integrate
from northfinder.attitude.methods import METHODS

__all__ = ["METHODS", "ConingMotion", "coning_drift_rad_s", "extract_increments", "integrate"]
