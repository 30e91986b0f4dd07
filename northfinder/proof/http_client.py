"""As much of HTTP/1.1 and of server-sent events as a load takes, at little cost of its own."""

import asyncio
import json
import re
from collections.abc import AsyncIterator
from typing import Any

JsonObject = dict[str, Any]

_ANSWER_S = 20.0
_SILENCE_S = 20.0  # a stream says at least that it is alive every 15 s
_NUMBER = re.compile(rb"^id: (\d+)$", re.MULTILINE)


class HttpConnection:
    """A connection to a service on this computer that stays open from request to request.

    Args:
        port: The service's.
    """

    def __init__(self, port: int) -> None:
        self._port = port
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
        self._turn = asyncio.Lock()

    async def ask(self, method: str, path: str, body: JsonObject | None = None) -> JsonObject:
        """Ask for JSON, after whoever asks on this connection already.

        Raises:
            RuntimeError: The answer is an error.
        """
        async with self._turn, asyncio.timeout(_ANSWER_S):
            status, headers = await self._begin(method, path, body)
            reader, _ = await self._opened()
            answer = await reader.readexactly(int(headers["content-length"]))
        if status not in {200, 202}:
            msg = f"{method} {path} was answered with {status}: {answer.decode()}"
            raise RuntimeError(msg)
        parsed: JsonObject = json.loads(answer)
        return parsed

    async def follow(self, path: str) -> AsyncIterator[int | None]:
        """Yield each event of a stream as it comes, by its number where it has one."""
        status, _ = await self._begin("GET", path, None)
        if status != 200:
            msg = f"the stream {path} was answered with {status}"
            raise RuntimeError(msg)
        waiting = b""
        while chunk := await self._chunk():
            *events, waiting = (waiting + chunk).split(b"\n\n")
            for event in events:
                if b"data: " in event:
                    number = _NUMBER.search(event)
                    yield int(number[1]) if number else None

    async def size_of(self, path: str) -> int:
        """Fetch what is no JSON, and return how many bytes it has.

        Raises:
            RuntimeError: The answer is an error, or empty.
        """
        async with self._turn, asyncio.timeout(_ANSWER_S):
            status, headers = await self._begin("GET", path, None)
            size = 0
            if "content-length" in headers:
                reader, _ = await self._opened()
                size = len(await reader.readexactly(int(headers["content-length"])))
            else:
                while chunk := await self._chunk():
                    size += len(chunk)
        if status != 200 or size == 0:
            msg = f"GET {path} was answered with {status} and {size} bytes"
            raise RuntimeError(msg)
        return size

    def close(self) -> None:
        """Close the connection."""
        if self._streams is not None:
            self._streams[1].close()
            self._streams = None

    async def _begin(
        self, method: str, path: str, body: JsonObject | None
    ) -> tuple[int, dict[str, str]]:
        reader, writer = await self._opened()
        content = b"" if body is None else json.dumps(body).encode()
        head = (
            f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{self._port}\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(content)}\r\n\r\n"
        )
        writer.write(head.encode() + content)
        first, *lines = (await reader.readuntil(b"\r\n\r\n")).decode().splitlines()[:-1]
        fields = (line.partition(":") for line in lines)
        return int(first.split()[1]), {name.lower(): value.strip() for name, _, value in fields}

    async def _chunk(self) -> bytes:
        """Return the next chunk (RFC 9112, section 7.1); the last is empty."""
        reader, _ = await self._opened()
        async with asyncio.timeout(_SILENCE_S):
            size = int(await reader.readline(), 16)
            return (await reader.readexactly(size + 2))[:-2]

    async def _opened(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        if self._streams is None:
            self._streams = await asyncio.open_connection("127.0.0.1", self._port)
        return self._streams
