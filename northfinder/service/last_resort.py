"""What no handler caught: logged once, with its traceback, and answered with a sentence."""

import asyncio
import logging
import secrets

import anyio
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from northfinder.service.problems import Problem

_LOG = logging.getLogger(__name__)
_ENDING = Problem(503, "service-ending", "The service was told to end: ask again when it is back.")


class LastResort:
    """Answers a defect of ours with a problem, where nothing has been answered yet."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and catch what comes of it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        has_begun = False

        async def send_noting(message: Message) -> None:
            nonlocal has_begun
            has_begun = True
            await send(message)

        try:
            await self._app(scope, receive, send_noting)
        except asyncio.CancelledError:
            # Only the server's shutdown cancels a request, and this task ends here: passed on,
            # it would be logged as a defect of ours.
            _LOG.info("cut off by the shutdown: %s %r", scope["method"], scope["path"])
            if not has_begun:
                await _ENDING.response()(scope, receive, send)
        except Exception as defect:  # noqa: BLE001 - this is the last resort
            if has_begun and _is_departure(defect):
                _LOG.info("the client has left: %s %s", scope["method"], scope["path"])
                return
            reference = secrets.token_hex(4)
            _LOG.error(
                "a defect, reference %s, in %s %r",
                reference,
                scope["method"],
                scope["path"],
                exc_info=defect,
            )
            if not has_begun:  # otherwise the server closes the connection
                await _problem(reference).response()(scope, receive, send)


def _is_departure(error: BaseException) -> bool:
    """Say whether all that failed is a stream whose reader has gone.

    FastAPI's keep-alive may be just about to write into it.
    """
    if isinstance(error, BaseExceptionGroup):
        return all(_is_departure(part) for part in error.exceptions)
    return isinstance(error, anyio.BrokenResourceError)


def _problem(reference: str) -> Problem:
    sentence = (
        "A defect of northfinder, not of the request: please report it, with what the service's "
        f"log says under the reference {reference}."
    )
    return Problem(500, "defect", sentence, reference=reference)
