"""Lets through who knows the token, or has a session for having shown it."""

import time
from collections.abc import Collection

from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from northfinder.service.problems import Problem
from northfinder.service.sessions import (
    COOKIE,
    PUBLIC_PATH,
    Guesses,
    Session,
    Sessions,
    client_of,
    unauthorized,
)


class TokenCheck:
    """Lets anyone to what is public, and to the rest who has a session or shows the token.

    Args:
        app: What comes after.
        sessions: The browsers that have shown it.
        guesses: What checks it.
        public_paths: What everyone may read: the page's files, which hold no secret.
    """

    def __init__(
        self, app: ASGIApp, sessions: Sessions, guesses: Guesses, public_paths: Collection[str]
    ) -> None:
        self._app = app
        self._sessions = sessions
        self._guesses = guesses
        self._public_paths = frozenset(public_paths)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check the session's cookie, or the token."""
        if scope["type"] != "http" or self._is_public(scope["method"], scope["path"]):
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        session = self._sessions.find(request.cookies.get(COOKIE))
        if session is not None:
            await self._app(scope, receive, _until_over(session, send))
            return
        try:
            self._check_token(request)
        except Problem as problem:
            await problem.response()(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _is_public(self, method: str, path: str) -> bool:
        if method == "POST":
            return path == PUBLIC_PATH
        return method in {"GET", "HEAD"} and path in self._public_paths

    def _check_token(self, request: Request) -> None:
        scheme, _, shown = request.headers.get("authorization", "").partition(" ")
        if scheme.lower() != "bearer":
            sentence = "The service needs a token."
            raise unauthorized(sentence)
        self._guesses.check(shown.strip(), client_of(request))


def _until_over(session: Session, send: Send) -> Send:
    """End an answer, which may be a stream of days, when the session that asked for it is over."""
    is_cut = False

    async def send_while_open(message: Message) -> None:
        nonlocal is_cut
        if is_cut:
            return  # until the stream notices that nobody listens any more
        if message.get("more_body") and session.is_over(time.monotonic()):
            is_cut = True
            message = {"type": "http.response.body", "body": b"", "more_body": False}
        await send(message)

    return send_while_open
