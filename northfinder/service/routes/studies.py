"""The papers, worked through: claims with their verdicts, figures, and a page to print.

A study takes seconds to compute, so each is worked through once in the life of the service, when
it is first asked for, on a thread of its own, one at a time. That thread is a daemon: unlike those
of the framework's pool it holds up no shutdown.
"""

import asyncio
import logging
import threading
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Path
from pydantic import BaseModel
from starlette.responses import HTMLResponse, Response

from northfinder.service import policies
from northfinder.service.messages import JsonObject
from northfinder.service.problems import Problem, problem_responses
from northfinder.service.routes.record import SvgResponse
from northfinder.studies.claim import Verdict
from northfinder.studies.papers import PAPERS
from northfinder.studies.registry import NAMES, run_study

_LOG: Final = logging.getLogger(__name__)
_DOCUMENT: Final = {"Content-Security-Policy": policies.DOCUMENT}
_ECHOED: Final = 64  # characters of a name that an answer repeats at most

Name = Annotated[str, Path(examples=["no-such-study"], description=f"One of {', '.join(NAMES)}.")]


class StudyEntry(BaseModel):
    """A study in the list; its verdicts are known once it has been worked through."""

    name: str
    title: str
    paper: str
    verdicts: dict[str, int] | None = None


class StudyList(BaseModel):
    """All studies; listing them works none through."""

    studies: list[StudyEntry]


class StudyFigure(BaseModel):
    """A figure, drawn at ``figures/{name}.svg``."""

    name: str
    title: str
    description: str


class StudyAnswer(BaseModel):
    """A study: every figure in full, and as it is written."""

    kind: Literal["study"]
    name: str
    title: str
    paper: str
    summary: str
    conditions: str
    claims: list[JsonObject]
    tables: list[JsonObject]
    figures: list[StudyFigure]
    software: JsonObject


@dataclass(frozen=True, slots=True)
class Worked:
    """All that a study has to show.

    Attributes:
        answer: As JSON.
        page: One HTML document.
        figures: SVG by name.
    """

    answer: JsonObject
    page: str
    figures: Mapping[str, str]

    def entry(self) -> StudyEntry:
        """Return what a list shows of it."""
        counts = Counter(claim["verdict"] for claim in self.answer["claims"])
        verdicts = {verdict.value: counts[verdict.value] for verdict in Verdict}
        return entry_of(self.answer["name"], verdicts)


def entry_of(name: str, verdicts: dict[str, int] | None = None) -> StudyEntry:
    """Return what a list shows of a study, worked through or not."""
    title, citation = PAPERS[name]
    return StudyEntry(name=name, title=title, paper=citation, verdicts=verdicts)


def work_through(name: str) -> Worked:
    """Compute a study and draw it; what that takes is imported only here."""
    from northfinder.studies.drawing import draw  # noqa: PLC0415 -- matplotlib
    from northfinder.studies.page import study_page  # noqa: PLC0415 -- the same
    from northfinder.studies.study_json import study_json  # noqa: PLC0415

    study = run_study(name)
    figures = {chart.name: draw(chart) for chart in study.charts}
    return Worked(study_json(study), study_page(study), figures)


class Shelf:
    """The studies that were worked through; safe from every thread.

    Args:
        work: Works one through.
    """

    def __init__(self, work: Callable[[str], Worked] = work_through) -> None:
        self._work = work
        self._kept: dict[str, Future[Worked]] = {}
        self._lock = threading.Lock()
        self._one_at_a_time = threading.Lock()

    def entries(self) -> list[StudyEntry]:
        """List every study with what is known of it."""
        return [done.entry() if (done := self._done(name)) else entry_of(name) for name in NAMES]

    async def study(self, name: str) -> Worked:
        """Return a study; whoever asks while it is worked through waits for the same one.

        Raises:
            Problem: There is none of this name.
            StudyError: What was measured does not bear its verdicts out; asked again, it is tried
                again.
        """
        if name not in NAMES:
            known = ", ".join(NAMES)
            sentence = f"There is no study {name[:_ECHOED]!r}; there are {known}."
            raise Problem(404, "unknown-study", sentence)
        return await asyncio.wrap_future(self._future(name))

    def _future(self, name: str) -> Future[Worked]:
        with self._lock:
            kept = self._kept.get(name)
            if kept is not None and not (kept.done() and kept.exception()):
                return kept
            future: Future[Worked] = Future()
            future.set_running_or_notify_cancel()  # one who goes away cancels it for nobody
            self._kept[name] = future
        threading.Thread(
            target=self._fill, args=(name, future), name=f"study {name}", daemon=True
        ).start()
        return future

    def _fill(self, name: str, future: Future[Worked]) -> None:
        with self._one_at_a_time:
            _LOG.info("study %s is worked through", name)
            try:
                worked = self._work(name)
            except Exception as error:  # noqa: BLE001 -- whoever waits is told
                _LOG.error("study %s: %s", name, error)
                future.set_exception(error)
            else:
                future.set_result(worked)

    def _done(self, name: str) -> Worked | None:
        with self._lock:
            kept = self._kept.get(name)
        return kept.result() if kept and kept.done() and not kept.exception() else None


def studies_router(shelf: Shelf | None = None) -> APIRouter:
    """Return the routes of the studies, over a shelf of their own."""
    shelf = shelf or Shelf()
    router = APIRouter(prefix="/studies", tags=["studies"])

    @router.get("")
    async def list_studies() -> StudyList:
        """The papers that are worked through."""
        return StudyList(studies=shelf.entries())

    @router.get("/{name}", responses=problem_responses(404, 409))
    async def get_study(name: Name) -> StudyAnswer:
        """One paper: each claim, the printed figure beside ours, the verdict; seconds at first."""
        return StudyAnswer(**(await shelf.study(name)).answer)

    @router.get(
        "/{name}/page.html", response_class=HTMLResponse, responses=problem_responses(404, 409)
    )
    async def get_page(name: Name) -> HTMLResponse:
        """The same as one document to read or print, figures and all."""
        return HTMLResponse((await shelf.study(name)).page, headers=_DOCUMENT)

    @router.get(
        "/{name}/figures/{figure}.svg",
        response_class=SvgResponse,
        responses=problem_responses(404, 409),
    )
    async def get_study_figure(name: Name, figure: str) -> Response:
        """One of its figures."""
        figures = (await shelf.study(name)).figures
        if figure not in figures:
            sentence = f"There is no figure {figure[:_ECHOED]!r}; there are {', '.join(figures)}."
            raise Problem(404, "unknown-figure", sentence)
        return SvgResponse(figures[figure], headers=_DOCUMENT)

    return router
