"""Alignment on a rocking base: attitude and heading from vectors seen in two frames.

Pure functions and streaming objects; no I/O, no clocks. b is right-front-up, n East-North-Up.
"""

from northfinder.alignment.aligner import SHORTEST_S, Aligner
from northfinder.alignment.limits import LimitLine, Limits, SensorErrors, predict_limits
from northfinder.alignment.methods import METHODS
from northfinder.alignment.result import Alignment
from northfinder.alignment.taper import TaperQuest
from northfinder.alignment.triad import optimized_triad, triad
from northfinder.alignment.wahba import davenport, quest, svd

__all__ = [
    "METHODS",
    "SHORTEST_S",
    "Aligner",
    "Alignment",
    "LimitLine",
    "Limits",
    "SensorErrors",
    "TaperQuest",
    "davenport",
    "optimized_triad",
    "predict_limits",
    "quest",
    "svd",
    "triad",
]
