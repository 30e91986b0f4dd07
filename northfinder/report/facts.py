"""What a record says of a run before any number of it: how, where, with what."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from northfinder.formatting import duration
from northfinder.records import Run, VisitStatistics
from northfinder.report.wording import (
    ORDERS,
    TRUTH,
    latitude,
    plain,
    plural,
    scientific,
    significant,
    utc,
)

#: Sections of a configuration that bear on north. The database's may hold a password.
_SECTIONS = ("site", "turntable", "gyro", "accelerometer")
_TOGETHER = "\N{NO-BREAK SPACE}"


@dataclass(frozen=True, slots=True)
class Fact:
    """A term and what it means here."""

    term: str
    text: str


def how_it_was_measured(run: Run, visits: Sequence[VisitStatistics]) -> list[Fact]:
    """Describe measurand, method, readings, site and time."""
    return [
        Fact(
            "Measurand",
            "Azimuth of the table's index mark (its angle zero): the horizontal angle from true "
            "north, clockwise. North is astronomic, by the Earth's rotation and the plumb line.",
        ),
        Fact("Method", _method(run.plan)),
        Fact("Readings", _readings(run.plan, visits)),
        Fact("Site", _site(run)),
        Fact("Recorded", f"{utc(run.started_utc)} to {utc(run.finished_utc)}"),
    ]


def _method(plan: Mapping[str, Any]) -> str:
    revolutions, order = plan.get("revolutions", 1), str(plan.get("order"))
    turns = "one revolution" if revolutions == 1 else f"{revolutions} revolutions"
    return (
        f"Gyrocompassing: rotation rate and specific force along a horizontal axis at "
        f"{plan.get('positions', '?')} table angles of {turns}, {ORDERS.get(order, order)}; "
        "R + a cos T + b sin T fitted to each; azimuth by coordinate transform with the tilt."
    )


def _readings(plan: Mapping[str, Any], visits: Sequence[VisitStatistics]) -> str:
    if not visits:
        return "No visit was completed."
    segments = len({visit.segment for visit in visits})
    samples, lost = sum(v.samples for v in visits), sum(v.lost for v in visits)
    dwell_s, settle_s = plan.get("dwell_s", 0.0), plan.get("settle_s", 0.0)
    return (
        f"{plural(len(visits), 'visit')} in {plural(segments, 'segment')}; {dwell_s:g} s at each "
        f"angle in all, each visit after {settle_s:g} s of settling; "
        f"{plural(samples, 'gyro sample')}, {lost or 'none'} lost of both sensors; first to last "
        f"visit {duration(visits[-1].start_s - visits[0].start_s)}."
    )


def _site(run: Run) -> str:
    site, planned_deg = run.site, run.plan.get("latitude_deg")
    latitude_deg = site.get("latitude_deg") if planned_deg is None else planned_deg
    words = [str(site.get("name", run.rig_name))]
    if latitude_deg is not None:
        sigma_deg = site.get("latitude_sigma_deg")
        about = f" (u = {significant(sigma_deg)}°)" if sigma_deg is not None else ""
        words.append(f"latitude {latitude(latitude_deg, 4)}{about}")
    if site.get("height_m") is not None:
        words.append(f"height {site['height_m']:g} m")
    if site.get("gravity_g") is not None:
        words.append(f"local gravity {site['gravity_g']:.5f} standard gravities")
    return ", ".join(words) + "."


@dataclass(frozen=True, slots=True)
class Instrument:
    """One device: who it says it is, how it was reached, how the link did."""

    role: str
    identity: str
    serial_number: str
    firmware: str
    driver: str
    link: str
    temperature: str
    frames: str
    errors: str


def instruments(rig: Mapping[str, Any]) -> list[Instrument]:
    """List the devices of a recorded rig."""
    return [_instrument(device) for device in rig.get("devices", ())]


def _instrument(device: Mapping[str, Any]) -> Instrument:
    identity, counters = device.get("identity") or {}, device.get("counters") or {}
    temperature_deg_c = device.get("temperature_deg_c")
    return Instrument(
        role=str(device.get("role", "")),
        identity=f"{identity.get('vendor', '')} {identity.get('model', '')}".strip() or "–",
        serial_number=identity.get("serial_number") or "–",
        firmware=identity.get("firmware") or "–",
        driver=str(device.get("driver", "–")),
        link=str(device.get("link", "–")),
        temperature="–" if temperature_deg_c is None else f"{temperature_deg_c:.1f} °C",
        frames=f"{counters.get('frames', 0):,}".replace(",", "\N{NARROW NO-BREAK SPACE}"),
        errors=" / ".join(str(counters.get(k, 0)) for k in ("crc_errors", "lost", "reconnects")),
    )


def configuration(run: Run) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the plan and the rig's configuration as they were, section by section."""
    config = run.rig.get("config") or {}
    sections = [("plan", run.plan), *((name, config.get(name) or {}) for name in _SECTIONS)]
    return [
        (name, [(key, plain(value)) for key, value in section.items()])
        for name, section in sections
        if section
    ]


@dataclass(frozen=True, slots=True)
class Simulation:
    """What a simulated rig had in place of the world."""

    devices: str
    truth: str


def simulation(run: Run) -> Simulation | None:
    """Describe the simulated world; None where there was none."""
    if run.simulation is None:
        return None
    links = {str(d.get("role")): str(d.get("link", "")) for d in run.rig.get("devices", ())}
    simulated = [role for role, link in links.items() if link.startswith("sim:")]
    return Simulation(
        devices=", ".join(simulated) or "instruments",
        truth=", ".join(_truth(run.simulation)),
    )


def _truth(truth: Mapping[str, Any]) -> Iterator[str]:
    for key, value in truth.items():
        name, unit = TRUTH.get(key, (key, ""))
        gap = "" if unit in {"", "°"} else _TOGETHER
        yield f"{name}{_TOGETHER}{scientific(value)}{gap}{unit}"
