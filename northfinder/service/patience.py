"""Connections that hold on to a place without asking for anything: uvicorn would let them."""

import asyncio
from typing import Final, cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

#: For a whole request, its body included: 64 kB at most, over any line in no time.
REQUEST_S: Final = 10.0
#: Beyond these the process would run out of files, and the records and ports with it.
MOST_CONNECTIONS: Final = 400
_ASKING = (h11.IDLE, h11.SEND_BODY)


class ImpatientProtocol(H11Protocol):
    """Uvicorn's, with a deadline for every request and a limit of connections.

    A connection beyond the limit is closed unheard. Between two requests uvicorn's own keep-alive
    holds, and an answer may take as long as it likes: a stream has no end.
    """

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override] # as uvicorn's
        """Begin to wait for the first request."""
        super().connection_made(transport)
        if len(self.connections) > MOST_CONNECTIONS:
            transport.abort()
            return
        self._await_request()

    def data_received(self, data: bytes) -> None:
        """Take what has come; the deadline stands until the request is whole."""
        if self._deadline is None:
            self._await_request()
        super().data_received(data)
        if cast("object", self.conn.their_state) not in _ASKING:
            self._forget_deadline()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        self._forget_deadline()
        super().connection_lost(exc)

    def _await_request(self) -> None:
        self._deadline = self.loop.call_later(REQUEST_S, self.transport.abort)

    def _forget_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
