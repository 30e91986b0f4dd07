"""What Prometheus reads, read with Prometheus' own parser."""

from typing import Any

from prometheus_client.parser import text_string_to_metric_families

from northfinder.service.metrics import Metrics, Moment
from northfinder.service.static_files import page_files, static_routes
from tests.service.asking import ask
from tests.service.shell_app import shell_app

_DEVICE: dict[str, Any] = {
    "role": "gyro",
    "state": "ok",
    "temperature_deg_c": 23.5,
    "counters": {"frames": 1000, "crc_errors": 2, "lost": 3, "reconnects": 1},
}
_SILENT = {**_DEVICE, "role": "turntable", "state": "offline", "temperature_deg_c": None}
_RIG: dict[str, Any] = {
    "table": {"angle_deg": 203.75},
    "devices": [_DEVICE, _SILENT],
    "database": {"ok": True},
    "software": {"version": "0.1.0"},
}


def read(metrics: Metrics, moment: Moment) -> dict[tuple[str, ...], float]:
    """Return every sample by its name and label values."""
    text = bytes(metrics.response(moment).body).decode()
    return {
        (sample.name, *(value for _, value in sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_the_rig_is_read_as_it_stands() -> None:
    samples = read(Metrics(), Moment(_RIG, {"completed": 7}, subscribers=3))
    assert samples["northfinder_table_angle_degrees",] == 203.75
    assert samples["northfinder_device_temperature_celsius", "gyro"] == 23.5
    assert ("northfinder_device_temperature_celsius", "turntable") not in samples
    assert samples["northfinder_device_crc_errors_total", "gyro"] == 2
    assert samples["northfinder_device_up", "gyro"] == 1
    assert samples["northfinder_device_up", "turntable"] == 0
    assert samples["northfinder_runs", "completed"] == 7
    assert samples["northfinder_runs", "failed"] == 0
    assert samples["northfinder_stream_subscribers",] == 3
    assert samples["northfinder_database_up",] == 1
    assert samples["northfinder_build_info", "0.1.0"] == 1


def test_what_cannot_be_known_is_left_out() -> None:
    rig = {**_RIG, "table": {"angle_deg": None}, "devices": [], "database": {"ok": False}}
    samples = read(Metrics(), Moment(rig, None, subscribers=0))
    assert samples["northfinder_database_up",] == 0
    assert not [name for name, *_ in samples if name in {"northfinder_runs", "_table_angle"}]


def test_requests_are_counted_by_route_whatever_strangers_ask() -> None:
    metrics = Metrics()
    app = shell_app(metrics=metrics)
    app.router.routes.extend(static_routes(page_files()))
    for path in ("/api/v1/runs/7", "/api/v1/runs/8", "/guess-1", "/guess-2/x", "/api/v1/session"):
        ask(app, "GET", path)
    ask(app, "GUESS", "/guess-3")
    ask(app, "GET", "/static/style.css")
    ask(app, "GET", "/static/guess-5")
    ask(app, "GET", "/guess-4", {"Host": "evil.example"})
    samples = read(metrics, Moment(_RIG, {}, subscribers=0))
    counted = {
        key[1:]: value for key, value in samples.items() if key[0].endswith("requests_total")
    }
    assert counted == {
        ("GET", "/api/v1/runs/{run_id}", "200"): 2,
        ("GET", "unknown", "404"): 2,
        ("GET", "unknown", "400"): 1,
        ("GET", "/api/v1/session", "405"): 1,
        ("other", "unknown", "404"): 1,
        ("GET", "/static/{name}", "200"): 1,
        ("GET", "/static/{name}", "404"): 1,
    }
