"""What a browser may do with an answer: its headers, and the policy of each kind of page."""

import base64
import hashlib

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_ALONE = ("default-src 'none'", "base-uri 'none'", "frame-ancestors 'none'")


def _policy(*directives: str) -> str:
    return "; ".join((*_ALONE, *directives))


#: Data: nothing in it is ever to be loaded, run or framed.
DATA = _policy("form-action 'none'")

#: Plotly writes style attributes; nothing inline runs.
_OWN_FILES = (
    "style-src 'self' 'unsafe-inline'",
    "img-src 'self' data:",
    "connect-src 'self'",
    "font-src 'self'",
    "form-action 'self'",
)

#: The page: its own files and its own service.
PAGE = _policy("script-src 'self'", *_OWN_FILES)

#: A self-contained document, the certificate or a figure: it may look like something, no more.
DOCUMENT = _policy("style-src 'unsafe-inline'", "img-src data:", "form-action 'none'")


def page_with_script(script: str) -> str:
    """Return the page's policy for one that also runs this inline script, and no other."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return _policy(f"script-src 'self' 'sha256-{digest}'", *_OWN_FILES)


_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
#: Only where the answer does not say so itself.
_DEFAULT_HEADERS = {"Content-Security-Policy": DATA, "Cache-Control": "no-store"}


class SecurityHeaders:
    """Adds the headers to every answer; a page or a document brings a policy of its own."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and add the headers to its answer."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.update(_HEADERS)
                for name, value in _DEFAULT_HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with_headers)
