"""No request may be large: the largest that anyone needs is a plan."""

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from northfinder.service.problems import Problem

MAX_BODY_BYTES = 64 * 1024
_DIGITS = 10  # int() itself refuses thousands of them


class BodyLimit:
    """Refuses a body beyond the limit: by what it says of itself, or when it has grown too long."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and count its body while it is read."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        stated = Headers(scope=scope).get("content-length", "0")
        is_short = stated.isdecimal() and len(stated) <= _DIGITS and int(stated) <= MAX_BODY_BYTES
        if not is_short:
            await _too_large().response()(scope, receive, send)
            return
        received_bytes = 0

        async def receive_counting() -> Message:
            nonlocal received_bytes
            message = await receive()
            received_bytes += len(message.get("body", b""))
            if received_bytes > MAX_BODY_BYTES:
                raise _too_large()  # an HTTPException: the application answers with it
            return message

        await self._app(scope, receive_counting, send)


def _too_large() -> Problem:
    sentence = f"The request's body is larger than {MAX_BODY_BYTES} bytes: send less."
    return Problem(413, "body-too-large", sentence)
