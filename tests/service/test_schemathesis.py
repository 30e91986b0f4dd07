"""Whatever the OpenAPI document allows, and what it forbids: no 500, no undocumented answer.

The streams are left out, as they do not end. Beside success, 404, 409 and 422 are right answers
to a request that fits the document: a schema cannot say that a run is over, that 300 positions in
30 revolutions are too many visits, or that a cursor was never handed out.
"""

import itertools
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis.config import SchemathesisConfig
from schemathesis.generation.modes import GenerationMode

from tests.evidence import Record
from tests.service.openapi import COMMITTED
from tests.service.process import LONG, SHORT, ServiceProcess

FIGURES = ("fit", "residuals", "dial", "convergence", "budget", "pie")
Case = schemathesis.Case[Any]
#: Without shrinking, for a service in another state gives another answer.
UNSHRUNK = settings(
    phases=[Phase.explicit, Phase.generate],
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
LEAST_EXAMPLES = 2000


def described(*, boundaries: bool) -> schemathesis.BaseSchema:
    """Return what is asked, always the same; with every boundary of every field or without."""
    expected = {"expected-statuses": ["2xx", "404", "409", "422"]}
    config = {
        "generation": {"deterministic": True, "database": "none"},
        "phases": {"coverage": {"enabled": boundaries}},
        "checks": {"positive_data_acceptance": expected},
    }
    whole = schemathesis.openapi.from_path(
        str(COMMITTED), config=SchemathesisConfig.from_dict(config)
    )
    return whole.exclude(path_regex="/events$")


class Stage:
    """A service with runs in every state, so that a request about a run can be about one.

    Attributes:
        asked: How many requests were checked.
    """

    def __init__(self, service: ServiceProcess) -> None:
        self._service = service
        self._world = service.api.get("/rig/simulation").json()
        self._run_ids = itertools.cycle([self._completed(), self._failed(), self._aborted(), None])
        self._figures = itertools.cycle(FIGURES)
        self.asked = 0

    def ask(self, case: Case) -> None:
        """Ask, and check the answer in every way that schemathesis knows."""
        self._prepare(case)
        case.call_and_validate(base_url=self._service.address, timeout=20.0)
        self.asked += 1
        if case.path.endswith("/faults"):
            self._service.api.delete("/rig/simulation/faults")
        elif case.path.endswith("/simulation"):  # a world that errs without bound finds no north
            self._service.api.patch("/rig/simulation", json=self._world)

    def _prepare(self, case: Case) -> None:
        """Name a run that exists in a valid request, and let a new run find the rig free."""
        is_valid = case.meta is None or case.meta.generation.mode is GenerationMode.POSITIVE
        names: dict[str, Any] = case.path_parameters or {}
        if is_valid and "run_id" in names:
            names["run_id"] = next(self._run_ids) or self._run_that_is_on()
        if is_valid and "name" in names:
            names["name"] = next(self._figures)
        if case.path.endswith("/runs") and case.method == "POST":
            self._service.api.post("/rig/stop")

    def _run_that_is_on(self) -> str:
        return self._service.api.get("/rig").json()["run_id"] or self._service.start(LONG)

    def _completed(self) -> str:
        run_id = self._service.start(SHORT)
        self._service.wait(run_id, "completed")
        return run_id

    def _failed(self) -> str:
        run_id = self._service.start(SHORT)
        fault = {"device": "turntable", "short_by_deg": 1}
        self._service.api.post("/rig/simulation/faults", json=fault)
        self._service.wait(run_id, "failed")
        self._service.api.delete("/rig/simulation/faults")
        return run_id

    def _aborted(self) -> str:
        run_id = self._service.start(LONG)
        self._service.api.post("/rig/stop")
        return run_id


@pytest.fixture(scope="module")
def stage(service: ServiceProcess) -> Stage:
    return Stage(service)


@pytest.mark.slow
@described(boundaries=False).parametrize()
@settings(UNSHRUNK, max_examples=8)
def test_every_answer_is_a_documented_one(case: Case, stage: Stage) -> None:
    stage.ask(case)


@pytest.mark.alone
@pytest.mark.proof
@pytest.mark.timeout(600)  # a hundred certificates
@described(boundaries=True).parametrize()
@settings(UNSHRUNK, max_examples=120)
def test_every_answer_of_two_thousand_is_a_documented_one(case: Case, stage: Stage) -> None:
    stage.ask(case)


@pytest.mark.alone
@pytest.mark.proof
def test_two_thousand_were_asked(stage: Stage, record_property: Record) -> None:
    """After the test above, of which pytest makes one for each operation, in this process."""
    record_property("measured", f"{stage.asked} asked")
    assert stage.asked >= LEAST_EXAMPLES
