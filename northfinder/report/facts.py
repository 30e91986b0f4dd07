"""What a record says of a run before any number of it: how, where, with what."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from northfinder.formatting import duration
from northfinder.records import Run, VisitStatistics
from northfinder.report.wording import (
    TRUTH,
    latitude,
    minus,
    plain,
    plural,
    scientific,
    significant,
    utc,
)
from northfinder.units import DEG

#: Sections of a configuration that bear on north. The database's may hold a password.
_SECTIONS = ("site", "turntable", "gyro", "accelerometer")
_TOGETHER = "\N{NO-BREAK SPACE}"


@dataclass(frozen=True, slots=True)
class Fact:
    """A term and what it means here."""

    term: str
    text: str


def visits_in_words(visits: Sequence[VisitStatistics], timing: str) -> str:
    """Say how many visits there were and what they brought; ``timing`` is of each."""
    if not visits:
        return "No visit was completed."
    segments = len({visit.segment for visit in visits})
    return (
        f"{plural(len(visits), 'visit')} in {plural(segments, 'segment')}; {timing}"
        f"{_samples(visits)}; first to last visit "
        f"{duration(visits[-1].start_s - visits[0].start_s)}."
    )


def stretches_in_words(run: Run, visits: Sequence[VisitStatistics]) -> str:
    """Say what came of a stream that was kept stretch by stretch, the table at one angle."""
    if not visits:
        return "No stretch of samples was kept."
    angle = minus(f"{visits[0].angle_rad / DEG:.4f}")
    table = run.rig.get("config", {}).get("turntable", {})
    where = "on a fixed mount" if table.get("driver") == "fixed" else f"the table at {angle}°"
    return (
        f"{plural(len(visits), 'stretch')} of one stream, {where}; {_samples(visits)}; "
        f"first to last stretch "
        f"{duration(visits[-1].start_s - visits[0].start_s)}."
    )


def _samples(visits: Sequence[VisitStatistics]) -> str:
    samples, lost = sum(v.samples for v in visits), sum(v.lost for v in visits)
    return f"{plural(samples, 'gyro sample')}, {lost or 'none'} lost of both sensors"


def recorded(run: Run) -> Fact:
    """Say when."""
    return Fact("Recorded", f"{utc(run.started_utc)} to {utc(run.finished_utc)}")


def site(run: Run, planned_deg: float | None) -> Fact:
    """Say where; a latitude of the plan's own goes before the site's."""
    site = run.site
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
    return Fact("Site", ", ".join(words) + ".")


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


@dataclass(frozen=True, slots=True)
class Section:
    """A section of a configuration: what was set, and the keys that were not."""

    name: str
    settings: list[tuple[str, str]]
    open: list[str]


def configuration(run: Run) -> list[Section]:
    """Return the plan and the rig's configuration as they were, section by section."""
    config = run.rig.get("config") or {}
    sections = {"plan": run.plan, **{name: config.get(name) or {} for name in _SECTIONS}}
    inner = {
        f"{name}.{key}": value
        for name, section in sections.items()
        for key, value in section.items()
        if isinstance(value, dict)
    }
    return [_section(name, keys) for name, keys in (sections | inner).items() if keys]


def _section(name: str, keys: Mapping[str, Any]) -> Section:
    single = {key: value for key, value in keys.items() if not isinstance(value, dict)}
    return Section(
        name,
        [(key, plain(value)) for key, value in single.items() if value is not None],
        [key for key, value in single.items() if value is None],
    )


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
    moves = run.simulation.get("base", "still") != "still"
    at_rest = "; the base moves, and azimuth, pitch and roll are those of the base at rest"
    return Simulation(
        devices=", ".join(simulated) or "instruments",
        truth=", ".join(_truth(run.simulation)) + (at_rest if moves else ""),
    )


def _truth(truth: Mapping[str, Any]) -> Iterator[str]:
    for key, value in truth.items():
        name, unit = TRUTH.get(key, (key, ""))
        gap = "" if unit in {"", "°"} else _TOGETHER
        yield f"{name}{_TOGETHER}{scientific(value)}{gap}{unit}"
