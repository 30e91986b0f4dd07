"""By which name the service is called, and from whose page.

Any site's page can make a browser send requests here: under a name of its own that it lets
resolve to this address ("DNS rebinding"), or straight to ours. Both are turned away.
"""

import re
from collections.abc import Collection

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from northfinder.service.problems import Problem

_SAFE_METHODS = {"GET", "HEAD", "OPTIONS"}
_AUTHORITY = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[^\[\]:/@\s]+)(:\d{1,5})?")
_ECHOED = 100


class HostCheck:
    """Answers only where the service is called by a name of its own.

    Args:
        app: What comes after.
        allowed_hosts: Those names, in lower case.
    """

    def __init__(self, app: ASGIApp, allowed_hosts: Collection[str]) -> None:
        self._app = app
        self._allowed = tuple(allowed_hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check the Host header."""
        if scope["type"] == "http" and (problem := self._problem(Headers(scope=scope))):
            await problem.response()(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _problem(self, headers: Headers) -> Problem | None:
        called = headers.getlist("host")
        match = _AUTHORITY.fullmatch(called[0].lower()) if len(called) == 1 else None
        if match and match["name"] in self._allowed:
            return None
        names = ", ".join(called)[:_ECHOED] or "no name at all"
        sentence = (
            f"The service was called by {names}, and answers to {', '.join(self._allowed)} only: "
            "start it with --allowed-host to add a name."
        )
        return Problem(400, "unknown-host", sentence)


class CrossOriginCheck:
    """Refuses what another site's page makes a browser ask for, except to open a page of ours.

    Programs that are no browser send neither Origin nor Sec-Fetch-Site and are let through.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check whose page the request comes from."""
        if scope["type"] == "http" and _is_foreign(scope["method"], Headers(scope=scope)):
            sentence = (
                "The request comes from another site's page; only this service's own page, and "
                "programs that are no browser, may make it."
            )
            await Problem(403, "cross-origin", sentence).response()(scope, receive, send)
            return
        await self._app(scope, receive, send)


def _is_foreign(method: str, headers: Headers) -> bool:
    is_elsewhere = headers.get("sec-fetch-site") in {"cross-site", "same-site"}
    if method in _SAFE_METHODS:
        mode, shown_in = headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")
        follows_a_link = mode == "navigate" and shown_in == "document"
        return is_elsewhere and not follows_a_link
    origin, host = headers.get("origin"), headers.get("host", "").lower()
    # A proxy may speak https to the browser and http to us.
    ours = {f"http://{host}", f"https://{host}"}
    return is_elsewhere or (origin is not None and origin.lower() not in ours)
