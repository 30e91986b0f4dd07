"""Requests to an application without a network in between; for streams there is a real server."""

import asyncio
from collections.abc import Mapping

import httpx
from starlette.types import ASGIApp


def ask(
    app: ASGIApp,
    method: str,
    path: str,
    headers: Mapping[str, str] | None = None,
    *,
    json: object = None,
    content: bytes | None = None,
) -> httpx.Response:
    """Send one request as a program on this computer would, and return its answer."""

    async def send() -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.request(method, path, headers=headers, json=json, content=content)

    return asyncio.run(send())
