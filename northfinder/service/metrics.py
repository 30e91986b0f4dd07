"""What Prometheus may ask: requests as they are answered, the rig as it stands when asked."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4
from prometheus_client.metrics_core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    InfoMetricFamily,
    Metric,
)
from prometheus_client.registry import Collector
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from northfinder.records.states import STATES, State

JsonObject = dict[str, Any]
_COUNTERS = {
    "frames": "Frames received from a device.",
    "crc_errors": "Frames whose checksum was wrong.",
    "lost": "Frames that a device sent and that never came.",
    "reconnects": "Times that the link to a device was opened again.",
}
_METHODS = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"}
_UNKNOWN = "unknown"  # all that strangers make up counts as one


@dataclass(frozen=True, slots=True)
class Moment:
    """What the rest of the service says of itself when it is asked.

    Attributes:
        rig: The rig, as ``GET /rig`` shows it.
        runs_by_state: How many runs are in each state; None while the records cannot say.
        subscribers: How many listen to streams.
    """

    rig: JsonObject
    runs_by_state: Mapping[State, int] | None
    subscribers: int


class Metrics:
    """The counters of one service, in a registry of their own."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        self._requests = Counter(
            "northfinder_http_requests",
            "Requests answered.",
            ["method", "route", "status"],
            registry=self._registry,
        )
        self._seconds = Histogram(
            "northfinder_http_request_seconds",
            "From a request to the head of its answer.",
            ["method", "route"],
            registry=self._registry,
        )

    def count(self, method: str, route: str, status: int, took_s: float) -> None:
        """Count one answered request."""
        method = method if method in _METHODS else "other"
        self._requests.labels(method, route, str(status)).inc()
        self._seconds.labels(method, route).observe(took_s)

    def response(self, moment: Moment) -> Response:
        """Return everything in Prometheus' text format."""
        body = generate_latest(_Everything(self._registry, moment))
        return Response(body, headers={"Content-Type": CONTENT_TYPE_PLAIN_0_0_4})


@dataclass(frozen=True, slots=True)
class _Everything(Collector):
    registry: CollectorRegistry
    moment: Moment

    def collect(self) -> Iterator[Metric]:
        """Yield what was counted, then what is."""
        yield from self.registry.collect()
        rig = self.moment.rig
        yield InfoMetricFamily(
            "northfinder_build", "This software.", value={"version": rig["software"]["version"]}
        )
        yield _gauge("northfinder_stream_subscribers", "Open streams.", self.moment.subscribers)
        yield _gauge(
            "northfinder_database_up", "Whether the records can be used.", rig["database"]["ok"]
        )
        yield from _of_runs(self.moment.runs_by_state)
        yield from _of_the_table(rig["table"])
        yield from _of_the_devices(rig["devices"])


def _gauge(name: str, says: str, value: float) -> Metric:
    return GaugeMetricFamily(name, says, value=float(value))


def _of_runs(by_state: Mapping[State, int] | None) -> Iterator[Metric]:
    if by_state is not None:
        runs = GaugeMetricFamily("northfinder_runs", "Recorded runs.", labels=["state"])
        for state in STATES:
            runs.add_metric([state], by_state.get(state, 0))
        yield runs


def _of_the_table(table: JsonObject | None) -> Iterator[Metric]:
    if table and table["angle_deg"] is not None:
        says = "The table's angle, counter-clockwise."
        yield _gauge("northfinder_table_angle_degrees", says, table["angle_deg"])


def _of_the_devices(devices: list[JsonObject]) -> Iterator[Metric]:
    up = GaugeMetricFamily("northfinder_device_up", "Whether it answers.", labels=["role"])
    warmth = GaugeMetricFamily(
        "northfinder_device_temperature_celsius", "A device's own.", labels=["role"]
    )
    for device in devices:
        up.add_metric([device["role"]], float(device["state"] == "ok"))
        if device["temperature_deg_c"] is not None:
            warmth.add_metric([device["role"]], device["temperature_deg_c"])
    yield from (up, warmth)
    for counter, says in _COUNTERS.items():
        family = CounterMetricFamily(f"northfinder_device_{counter}", says, labels=["role"])
        for device in devices:
            if (count := (device["counters"] or {}).get(counter)) is not None:
                family.add_metric([device["role"]], count)
        yield family


class CountedRequests:
    """Counts every request by the route that answered it, for there are few of those."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and count it when its answer begins."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        begun_s = time.monotonic()

        async def send_counting(message: Message) -> None:
            if message["type"] == "http.response.start":
                took_s = time.monotonic() - begun_s
                self._metrics.count(scope["method"], route_of(scope), message["status"], took_s)
            await send(message)

        await self._app(scope, receive, send_counting)


def route_of(scope: Scope) -> str:
    """Return the template of the path that a route has answered: ``/api/v1/runs/{run_id}``.

    A route knows its template without what its routers have in front of it; that part of the
    path has no parameters, so it is taken from the path itself.
    """
    template: str | None = getattr(scope.get("route"), "path_format", None)
    if template is None:
        return _UNKNOWN
    ending = template.format_map(scope.get("path_params", {}))
    path: str = scope["path"]
    return path.removesuffix(ending) + template if path.endswith(ending) else template
