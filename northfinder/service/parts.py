"""The parts of a running service, as its routes are handed them."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from northfinder.config import RigConfig
from northfinder.records import Records
from northfinder.service.hub import Hub
from northfinder.service.metrics import Metrics
from northfinder.service.rig_feed import RigFeed
from northfinder.service.rig_thread import RigThread


@dataclass(frozen=True, slots=True)
class Parts:
    """What a route may need.

    Attributes:
        config: The rig, its latitude filled in.
        records: The runs; safe from every thread.
        thread: The rig.
        feed: The rig's picture.
        hub: The runs' events.
        metrics: What is counted.
    """

    config: RigConfig
    records: Records
    thread: RigThread
    feed: RigFeed
    hub: Hub
    metrics: Metrics


def _parts(request: Request) -> Parts:
    parts: Parts = request.app.state.parts
    return parts


PartsOf = Annotated[Parts, Depends(_parts)]
