"""The papers over REST: listed at once, each worked through once, none in the way of the end."""

import threading
import time
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from northfinder.service.problems import install_problems
from northfinder.service.routes.studies import Shelf, Worked, studies_router, work_through
from northfinder.studies.claim import StudyError, Verdict
from northfinder.studies.registry import NAMES
from tests.service.asking import ask
from tests.service.process import ServiceProcess, serving, wait_until_ready

_QUICK = "coning-rk4"
_SLOW = "coning-rate-vector"  # a dozen seconds


@pytest.fixture(scope="module")
def shelf() -> Shelf:
    return Shelf()


def _get(shelf: Shelf, path: str) -> httpx.Response:
    app = FastAPI()
    app.include_router(studies_router(shelf))
    install_problems(app)
    return ask(app, "GET", path)


def test_a_list_works_nothing_through() -> None:
    def never(name: str) -> Worked:
        raise AssertionError(name)

    studies = _get(Shelf(never), "/studies").json()["studies"]
    assert [study["name"] for study in studies] == list(NAMES)
    assert {study["verdicts"] for study in studies} == {None}
    assert all(study["title"] and study["paper"] for study in studies)


def test_a_study_tells_its_claims_and_the_list_counts_them(shelf: Shelf) -> None:
    study = _get(shelf, f"/studies/{_QUICK}").json()
    assert (study["kind"], study["name"]) == ("study", _QUICK)
    verdicts = [claim["verdict"] for claim in study["claims"]]
    listed = {entry["name"]: entry for entry in _get(shelf, "/studies").json()["studies"]}
    assert listed[_QUICK]["verdicts"] == {kind: verdicts.count(kind) for kind in Verdict}
    assert (listed[_QUICK]["title"], listed[_QUICK]["paper"]) == (study["title"], study["paper"])


def test_its_figures_and_its_page_are_documents_that_run_nothing(shelf: Shelf) -> None:
    study = _get(shelf, f"/studies/{_QUICK}").json()
    page = _get(shelf, f"/studies/{_QUICK}/page.html")
    figures = [
        _get(shelf, f"/studies/{_QUICK}/figures/{figure['name']}.svg")
        for figure in study["figures"]
    ]
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert study["title"] in page.text
    for document in (page, *figures):
        assert "script-src" not in document.headers["content-security-policy"]
        assert document.headers["content-security-policy"].startswith("default-src 'none'")
    for figure, described in zip(figures, study["figures"], strict=True):
        assert figure.headers["content-type"].startswith("image/svg+xml")
        assert described["title"] in figure.text


@pytest.mark.parametrize(
    ("path", "name", "known"),
    [
        ("/studies/astrology", "unknown-study", _QUICK),
        ("/studies/astrology/page.html", "unknown-study", _QUICK),
        ("/studies/astrology/figures/stars.svg", "unknown-study", _QUICK),
        (f"/studies/{_QUICK}/figures/stars.svg", "unknown-figure", "there are "),
    ],
)
def test_what_there_is_not_is_404_and_names_what_there_is(
    shelf: Shelf, path: str, name: str, known: str
) -> None:
    answer = _get(shelf, path)
    assert answer.status_code == 404
    problem = answer.json()
    assert problem["type"] == f"/problems/{name}"
    assert known in problem["detail"]


def test_many_who_ask_at_once_wait_for_the_same_one() -> None:
    worked: list[str] = []

    def work(name: str) -> Worked:
        worked.append(name)
        time.sleep(0.2)  # long enough for the others to come
        return work_through(name)

    shelf = Shelf(work)
    answers: list[int] = []
    askers = [
        threading.Thread(
            target=lambda: answers.append(_get(shelf, f"/studies/{_QUICK}").status_code)
        )
        for _ in range(8)
    ]
    for asker in askers:
        asker.start()
    for asker in askers:
        asker.join()
    assert answers == [200] * 8
    assert worked == [_QUICK]


def test_a_study_that_does_not_bear_its_verdicts_out_is_tried_again() -> None:
    tried: list[str] = []

    def work(name: str) -> Worked:
        tried.append(name)
        if len(tried) == 1:
            msg = "eq 17: 1 deg/h does not bear out the verdict"
            raise StudyError(msg)
        return work_through(name)

    shelf = Shelf(work)
    refused = _get(shelf, f"/studies/{_QUICK}")
    assert refused.status_code == 409
    assert "does not bear out" in refused.json()["detail"]
    assert _get(shelf, "/studies").json()["studies"][0]["verdicts"] is None
    assert _get(shelf, f"/studies/{_QUICK}").status_code == 200


def test_the_service_lists_them(service: ServiceProcess) -> None:
    listed = service.api.get("/studies").json()["studies"]
    assert [study["name"] for study in listed] == list(NAMES)
    assert service.api.get("/studies/astrology").status_code == 404


def test_a_study_under_way_does_not_hold_up_the_end(tmp_path: Path) -> None:
    with serving(tmp_path) as service:
        wait_until_ready(service)
        waiting = threading.Thread(target=_ask_in_vain, args=(service.address,))
        waiting.start()
        service.wait_for_log(f"study {_SLOW} is worked through")
        assert service.end() < 8.0  # the study has a dozen seconds to go, more on a busy computer
        waiting.join()


def _ask_in_vain(address: str) -> None:
    with pytest.raises(httpx.HTTPError):
        httpx.get(f"{address}/api/v1/studies/{_SLOW}", timeout=30.0).raise_for_status()
