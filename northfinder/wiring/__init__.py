"""The one place that chooses hardware or simulation: from a configuration to a rig."""

from northfinder.wiring.build import build_rig
from northfinder.wiring.defaults import is_simulated, with_latitude, with_speed
from northfinder.wiring.loops import event_loop, require_finite_speed, serving_loop
from northfinder.wiring.serving import serve_simulation
from northfinder.wiring.world import SimulatedWorld, build_world

__all__ = [
    "SimulatedWorld",
    "build_rig",
    "build_world",
    "event_loop",
    "is_simulated",
    "require_finite_speed",
    "serve_simulation",
    "serving_loop",
    "with_latitude",
    "with_speed",
]
