"""The plainest FastAPI service of given answers, and bare bytes over a socket, as a process.

``python -m northfinder.proof.plain_service ANSWERS``: a JSON object of answer by path. Prints the
port of the service and that of the bytes.
"""

import asyncio
import json
import socket
import sys
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI

Answers = dict[str, dict[str, Any]]


def plain_app(answers: Answers) -> FastAPI:
    """Make an app whose every path returns its dict."""
    app = FastAPI()
    for path, answer in answers.items():
        app.get(path)(lambda answer=answer: answer)
    return app


async def _serve(answers: Answers) -> None:
    """Serve both until the process ends."""
    config = uvicorn.Config(plain_app(answers), log_level="warning", access_log=False)
    bare = await asyncio.start_server(lambda r, w: _answer(answers, r, w), "127.0.0.1", 0)
    # The protocol by name, as whoever starts uvicorn by host and port has it: without it asyncio
    # sets no TCP_NODELAY, and every answer waits 40 ms for an acknowledgement.
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP) as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()  # uvicorn does so after its start: until then a client is refused
        ports = (each.getsockname()[1] for each in (listening, bare.sockets[0]))
        sys.stdout.write(" ".join(map(str, ports)) + "\n")
        sys.stdout.flush()
        await uvicorn.Server(config).serve(sockets=[listening])
    bare.close()


async def _answer(
    answers: Answers, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
) -> None:
    """Answer each request by bytes that were made before: no headers read, no JSON."""
    ready = {path: _bytes_of(json.dumps(answer).encode()) for path, answer in answers.items()}
    while request := await reader.readline():
        while (await reader.readline()).strip():
            pass
        writer.write(ready[request.split(b" ", 2)[1].decode()])
    writer.close()


def _bytes_of(body: bytes) -> bytes:
    return b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n%s" % (len(body), body)


if __name__ == "__main__":
    asyncio.run(_serve(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))))
