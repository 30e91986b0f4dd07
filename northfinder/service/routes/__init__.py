"""The routes, by what they are about."""

from northfinder.service.routes import health, record, rig, runs, simulation

__all__ = ["health", "record", "rig", "runs", "simulation"]
