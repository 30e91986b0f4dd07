"""Browsers that have shown the token: a cookie in place of it, for EventSource sends no headers."""

import hashlib
import hmac
import secrets
import time
from collections import deque
from dataclasses import dataclass
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from northfinder.service.problems import Problem, problem_responses

PATH = "/session"
PUBLIC_PATH = f"/api/v1{PATH}"  # below the API's prefix: the one write that needs no token
COOKIE = "northfinder_session"
IDLE_S = 8 * 3600.0  # a working day without a request
LIFE_S = 24 * 3600.0
_SESSIONS = 100
_WRONG_TOKENS = 30
_WINDOW_S = 60.0
_CLIENTS = 1000


@dataclass(slots=True)
class Session:
    """One browser's session; times are of the monotonic clock."""

    opened_s: float
    used_s: float
    closed: bool = False

    def is_over(self, now_s: float) -> bool:
        """Say whether it was closed, or has stood idle or lived too long."""
        return self.closed or now_s - self.used_s > IDLE_S or now_s - self.opened_s > LIFE_S


class Sessions:
    """The open sessions, in memory: a restart ends them. Belongs to the web's loop."""

    def __init__(self) -> None:
        self._sessions: dict[str, Session] = {}

    def open(self) -> str:
        """Open a session and return its secret; the one unused for longest makes room."""
        now_s = time.monotonic()
        over = [key for key, session in self._sessions.items() if session.is_over(now_s)]
        if not over and len(self._sessions) >= _SESSIONS:
            over = [min(self._sessions, key=lambda key: self._sessions[key].used_s)]
        for key in over:
            self._sessions.pop(key).closed = True
        secret = secrets.token_urlsafe(32)
        self._sessions[_key(secret)] = Session(opened_s=now_s, used_s=now_s)
        return secret

    def find(self, secret: str | None) -> Session | None:
        """Return the session that is open under a secret, now used once more."""
        session = self._sessions.get(_key(secret)) if secret else None
        now_s = time.monotonic()
        if session is None or session.is_over(now_s):
            return None
        session.used_s = now_s
        return session

    def close(self, secret: str | None) -> None:
        """End the session under a secret, if there is one."""
        session = self._sessions.pop(_key(secret), None) if secret else None
        if session is not None:
            session.closed = True


def _key(secret: str) -> str:
    """Hash a secret: who reads the memory cannot use it, and comparing takes no telling time."""
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).hexdigest()


class Guesses:
    """The token, and who has guessed it wrong lately. Belongs to the web's loop.

    Args:
        token: What a client must know.
    """

    def __init__(self, token: str) -> None:
        self._token = token.encode()
        self._wrong_s: dict[str, deque[float]] = {}

    def check(self, shown: str, client: str) -> None:
        """Compare what a client shows with the token.

        Raises:
            Problem: It is not the token (401), or too many were not (429).
        """
        now_s = time.monotonic()
        wrong_s = self._wrong_s.get(client, deque())
        while wrong_s and now_s - wrong_s[0] > _WINDOW_S:
            wrong_s.popleft()
        if len(wrong_s) >= _WRONG_TOKENS:
            raise _too_many(_WINDOW_S - (now_s - wrong_s[0]))
        if not hmac.compare_digest(shown.encode("utf-8", "surrogatepass"), self._token):
            self._remember(client, wrong_s, now_s)
            sentence = "This is not the service's token."
            raise unauthorized(sentence)

    def _remember(self, client: str, wrong_s: deque[float], now_s: float) -> None:
        wrong_s.append(now_s)
        self._wrong_s.pop(client, None)
        self._wrong_s[client] = wrong_s  # as the youngest
        if len(self._wrong_s) > _CLIENTS:
            del self._wrong_s[next(iter(self._wrong_s))]


def unauthorized(sentence: str) -> Problem:
    """Return a 401 that says how to identify oneself."""
    how = (
        "Sign in on the page with the token that the service was started with, or send it as "
        "Authorization: Bearer."
    )
    headers = {"WWW-Authenticate": 'Bearer realm="northfinder"'}
    return Problem(401, "token-needed", f"{sentence} {how}", headers=headers)


def _too_many(wait_s: float) -> Problem:
    seconds = max(1, round(wait_s))
    sentence = f"Too many wrong tokens came from this address: wait {seconds} s and try again."
    return Problem(429, "too-many-attempts", sentence, headers={"Retry-After": str(seconds)})


class Credentials(BaseModel):
    """What a browser shows once, to be known by a cookie from then on."""

    model_config = ConfigDict(extra="forbid")

    token: Annotated[str, Field(min_length=1, max_length=1000)]


def session_router(sessions: Sessions, guesses: Guesses | None) -> APIRouter:
    """Return the routes that open and end a session.

    Args:
        sessions: The open ones.
        guesses: What checks the token; None where the service needs none.
    """
    router = APIRouter(tags=["session"])

    @router.post(
        PATH, status_code=HTTPStatus.NO_CONTENT, responses=problem_responses(401, 409, 429)
    )
    async def open_session(credentials: Credentials, request: Request) -> Response:
        """Exchange the service's token for a session cookie."""
        if guesses is None:
            raise Problem(409, "no-token-needed", "This service needs no token: go on without.")
        guesses.check(credentials.token, client_of(request))
        response = Response(status_code=HTTPStatus.NO_CONTENT)
        response.set_cookie(
            COOKIE,
            sessions.open(),
            max_age=round(LIFE_S),
            secure=request.url.scheme == "https",
            httponly=True,
            samesite="strict",
        )
        return response

    @router.delete(PATH, status_code=HTTPStatus.NO_CONTENT)
    async def end_session(request: Request) -> Response:
        """End the session; its streams end too."""
        sessions.close(request.cookies.get(COOKIE))
        response = Response(status_code=HTTPStatus.NO_CONTENT)
        response.delete_cookie(COOKIE, httponly=True, samesite="strict")
        return response

    return router


def client_of(request: Request) -> str:
    """Return the address that a request comes from."""
    return request.client.host if request.client else "unknown"
