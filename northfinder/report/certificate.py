"""The certificate: one printable HTML file of a run, complete in itself.

No script, no font, no picture from elsewhere: it reads the same in ten years, from a disk
without a network, and under any Content-Security-Policy that allows inline style.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

from northfinder.errors import NorthfinderError
from northfinder.records import Run, VisitStatistics
from northfinder.report import (
    alignment_certificate,
    facts,
    heading_hold_certificate,
    noise_certificate,
    north_seek_certificate,
)
from northfinder.report.figures import Estimates
from northfinder.report.frame import Room, render
from northfinder.report.wording import KINDS, utc

_ROOMS: Final[Mapping[str, Room]] = MappingProxyType(
    {
        "north-seek": north_seek_certificate,
        "alignment": alignment_certificate,
        "heading-hold": heading_hold_certificate,
        "noise": noise_certificate,
    }
)
_STATES = {
    "queued": "not begun",
    "running": "still running",
    "paused": "paused",
    "failed": "stopped by a failure",
    "aborted": "aborted",
    "interrupted": "interrupted",
}


class NoCertificateError(NorthfinderError):
    """This kind of run has no certificate."""


def certificate(
    run: Run, visits: Sequence[VisitStatistics], estimates: Estimates, samples_sha256: str
) -> str:
    """Return a run's certificate; of one without a result, the record of what it did.

    Args:
        run: As recorded.
        visits: Its completed visits in time order.
        estimates: Data of its ``estimate`` events in time order; none in old records.
        samples_sha256: Hash of its raw samples, hexadecimal.

    Raises:
        NoCertificateError: The run is of a kind that this version does not know.
    """
    room = _ROOMS.get(run.kind)
    if room is None:
        msg = (
            f"run {run.id} is of the kind {run.kind}, which has no certificate in this version; "
            f"there is one of {', '.join(KINDS.values())}"
        )
        raise NoCertificateError(msg)
    common = _common(run, samples_sha256) | {"facts": room.facts(run, visits)}
    if run.result is not None:
        template = f"{run.kind.replace('-', '_')}.html"
        return render(template, {**common, **room.completed(run, run.result, estimates)})
    told = {"state": _STATES.get(run.state, run.state), "visits": [], "left_out": 0}
    return render("unfinished.html", {**common, **told, **room.unfinished(run, visits, estimates)})


def _common(run: Run, samples_sha256: str) -> dict[str, Any]:
    return {
        "run": run,
        "footer": f"northfinder, run {run.id}{', SIMULATED' if run.simulation else ''}",
        "created": utc(run.created_utc),
        "instruments": facts.instruments((run.result or {}).get("rig", run.rig)),
        "configuration": facts.configuration(run),
        "simulation": facts.simulation(run),
        "samples_sha256": samples_sha256,
    }
