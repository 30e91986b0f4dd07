"""Who is let in: by which name, from whose page, with which token, and with how much to say."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import httpx
import pytest
from starlette.types import ASGIApp, Message

from northfinder.errors import ConfigError
from northfinder.service import policies
from northfinder.service.body_limit import MAX_BODY_BYTES
from northfinder.service.sessions import COOKIE, IDLE_S, LIFE_S, Session, Sessions
from northfinder.service.settings import service_settings
from tests.service.asking import ask
from tests.service.shell_app import TOKEN, shell_app

_RUN = "/api/v1/runs/7"
_WISH = "/api/v1/wishes"
_BEARER = {"Authorization": f"Bearer {TOKEN}"}


@pytest.mark.parametrize(
    "host", ["localhost", "LOCALHOST:8000", "127.0.0.1", "127.0.0.1:80", "[::1]:8000"]
)
def test_the_service_answers_to_its_own_names(host: str) -> None:
    assert ask(shell_app(), "GET", _RUN, {"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "host",
    ["evil.example", "localhost.evil.example", "localhost@evil.example", "", "::1", "[::1]x"],
)
def test_a_foreign_name_that_resolves_to_us_is_turned_away(host: str) -> None:
    answer = ask(shell_app(), "GET", _RUN, {"Host": host})
    assert answer.status_code == 400
    assert answer.json()["type"] == "/problems/unknown-host"


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "http://localhost:3000"},  # another program's page on this computer
        {"Origin": "null"},  # a sandboxed frame, a file
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_a_write_from_another_sites_page_is_refused(headers: dict[str, str]) -> None:
    answer = ask(shell_app(), "POST", _WISH, headers, json={"kind": "noise"})
    assert answer.status_code == 403
    assert answer.json()["type"] == "/problems/cross-origin"


@pytest.mark.parametrize(
    "headers",
    [{}, {"Origin": "http://localhost", "Sec-Fetch-Site": "same-origin"}],
)
def test_a_program_and_our_own_page_may_write(headers: dict[str, str]) -> None:
    assert ask(shell_app(), "POST", _WISH, headers, json={"kind": "noise"}).status_code == 200


def test_another_site_may_link_to_us_but_not_read_or_frame_us() -> None:
    elsewhere = {"Sec-Fetch-Site": "cross-site"}
    link = {**elsewhere, "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}
    frame = {**link, "Sec-Fetch-Dest": "iframe"}
    image = {**elsewhere, "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}
    statuses = [ask(shell_app(), "GET", _RUN, each).status_code for each in (link, frame, image)]
    assert statuses == [200, 403, 403]


def test_every_answer_tells_the_browser_to_be_careful() -> None:
    for path in (_RUN, "/nowhere", "/api/v1/defect"):
        headers = ask(shell_app(), "GET", path).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert headers["cache-control"] == "no-store"
        assert "default-src 'none'" in headers["content-security-policy"]


def test_no_policy_lets_a_script_run_that_is_not_ours() -> None:
    every = (policies.DATA, policies.PAGE, policies.DOCUMENT, policies.page_with_script("x()"))
    for policy in every:
        directives = dict(part.split(" ", 1) for part in policy.split("; "))
        scripts = directives.get("script-src", directives["default-src"])
        assert "unsafe" not in scripts
        assert "http" not in policy
        assert directives["frame-ancestors"] == "'none'"


@asynccontextmanager
async def _streaming(
    app: ASGIApp, cookie: bytes, sent: asyncio.Queue[Message]
) -> AsyncIterator[None]:
    """Ask for the endless stream as a server would, and put into a queue what it sends."""
    gone = asyncio.Event()
    scope = {
        "type": "http", "asgi": {"version": "3.0", "spec_version": "2.3"}, "http_version": "1.1",
        "method": "GET", "scheme": "http", "path": "/stream", "raw_path": b"/stream",
        "query_string": b"", "root_path": "", "headers": [(b"host", b"localhost"),
        (b"cookie", cookie)], "client": ("127.0.0.1", 1), "server": ("127.0.0.1", 80),
    }  # fmt: skip

    async def receive() -> Message:
        await gone.wait()
        return {"type": "http.disconnect"}

    task = asyncio.ensure_future(app(scope, receive, sent.put))
    yield
    gone.set()
    await task


# The token


def test_without_the_token_only_what_is_public_is_reached() -> None:
    app = shell_app(token=TOKEN)
    assert ask(app, "GET", "/healthz").status_code == 200
    for method, path in [("GET", _RUN), ("GET", "/stream"), ("GET", "/openapi.json"),
                         ("POST", _WISH), ("POST", "/healthz"), ("GET", "/api/v1/session"),
                         ("GET", "/nowhere"), ("GET", "/healthz/../openapi.json")]:  # fmt: skip
        answer = ask(app, method, path)
        assert answer.status_code == 401, path
        assert answer.headers["www-authenticate"].startswith("Bearer")
        assert answer.json()["type"] == "/problems/token-needed"


@pytest.mark.parametrize("shown", ["", "Bearer", "Bearer x", f"Basic {TOKEN}", f"Bearer {TOKEN}x"])
def test_a_wrong_token_is_no_token(shown: str) -> None:
    assert ask(shell_app(token=TOKEN), "GET", _RUN, {"Authorization": shown}).status_code == 401


def test_a_program_sends_the_token_itself() -> None:
    assert ask(shell_app(token=TOKEN), "GET", _RUN, _BEARER).status_code == 200


def test_a_browser_exchanges_the_token_for_a_cookie_that_ends() -> None:
    app = shell_app(token=TOKEN)
    opened = ask(app, "POST", "/api/v1/session", json={"token": TOKEN})
    assert opened.status_code == 204
    said = opened.headers["set-cookie"]
    attributes = {part.strip().lower() for part in said.split(";")}
    assert {"httponly", "samesite=strict", "path=/"} <= attributes
    assert TOKEN not in said
    cookie = {"Cookie": f"{COOKIE}={opened.cookies[COOKIE]}"}
    assert ask(app, "GET", _RUN, cookie).status_code == 200
    assert ask(app, "DELETE", "/api/v1/session", cookie).status_code == 204
    assert ask(app, "GET", _RUN, cookie).status_code == 401


def test_the_cookie_of_an_https_page_never_travels_without() -> None:
    async def sign_in() -> httpx.Response:
        transport = httpx.ASGITransport(shell_app(token=TOKEN))
        async with httpx.AsyncClient(transport=transport, base_url="https://localhost") as client:
            return await client.post("/api/v1/session", json={"token": TOKEN})

    assert "Secure" in asyncio.run(sign_in()).headers["set-cookie"]


def test_guessing_is_slowed_down() -> None:
    app = shell_app(token=TOKEN)
    wrong = [
        ask(app, "POST", "/api/v1/session", json={"token": str(n)}).status_code for n in range(31)
    ]
    assert wrong == [401] * 30 + [429]
    even_the_right_one = ask(app, "POST", "/api/v1/session", json={"token": TOKEN})
    assert even_the_right_one.status_code == 429
    assert 0 < int(even_the_right_one.headers["retry-after"]) <= 60
    assert ask(app, "GET", _RUN, _BEARER).status_code == 429


def test_a_service_without_a_token_says_so() -> None:
    answer = ask(shell_app(), "POST", "/api/v1/session", json={"token": TOKEN})
    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/no-token-needed")


def test_a_session_ends_when_it_is_not_used_or_after_a_day() -> None:
    assert not Session(opened_s=0.0, used_s=0.0).is_over(IDLE_S)
    assert Session(opened_s=0.0, used_s=0.0).is_over(IDLE_S + 1.0)
    assert not Session(opened_s=0.0, used_s=LIFE_S).is_over(LIFE_S)
    assert Session(opened_s=0.0, used_s=LIFE_S).is_over(LIFE_S + 1.0)


def test_there_are_never_more_than_a_hundred_sessions() -> None:
    sessions = Sessions()
    secrets = [sessions.open() for _ in range(101)]
    assert sessions.find(secrets[0]) is None
    assert all(sessions.find(secret) for secret in secrets[1:])


def test_a_stream_ends_with_its_session() -> None:
    """Signed out in one tab, and nothing flows into the other any more."""

    async def sign_out_while_it_streams() -> bool:
        app = shell_app(token=TOKEN)
        sent: asyncio.Queue[Message] = asyncio.Queue()
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            await client.post("/api/v1/session", json={"token": TOKEN})
            cookie = f"{COOKIE}={client.cookies[COOKIE]}".encode()
            async with asyncio.timeout(10.0), _streaming(app, cookie, sent):
                assert (await sent.get())["status"] == 200
                await client.delete("/api/v1/session")
                while (await sent.get()).get("more_body"):
                    pass
                return sent.empty()

    assert asyncio.run(sign_out_while_it_streams())


# How much to say


def test_a_body_may_be_64_kilobytes_and_no_more() -> None:
    blanks = b" " * (MAX_BODY_BYTES - len(b'{"kind": "noise"}'))
    json = {"Content-Type": "application/json"}
    fits = ask(shell_app(), "POST", _WISH, json, content=b'{"kind": "noise"}' + blanks)
    assert fits.status_code == 200
    too_long = ask(shell_app(), "POST", _WISH, json, content=b'{"kind": "noise"} ' + blanks)
    assert too_long.status_code == 413
    assert too_long.json()["type"] == "/problems/body-too-large"


def test_a_body_that_does_not_say_how_long_it_is_is_counted() -> None:
    async def drip() -> AsyncIterator[bytes]:
        for _ in range(1000):
            yield b" " * 1000

    async def send() -> httpx.Response:
        transport = httpx.ASGITransport(shell_app())
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            headers = {"Content-Type": "application/json"}
            return await client.post(_WISH, content=drip(), headers=headers)

    assert asyncio.run(send()).status_code == 413


# Where it listens


def test_on_loopback_nothing_is_needed() -> None:
    for host in ("127.0.0.1", "::1", "localhost"):
        settings = service_settings(host, 8000, None, ["Bench.lab"], "sqlite://")
        assert settings.allowed_hosts == ("localhost", "127.0.0.1", "[::1]", "bench.lab")


@pytest.mark.parametrize(
    ("token", "names", "said"),
    [
        (None, ["bench.lab"], "NORTHFINDER_TOKEN"),
        ("", ["bench.lab"], "NORTHFINDER_TOKEN"),
        ("short", ["bench.lab"], "has 5 characters, at least 16"),
        ("two words are sixteen", ["bench.lab"], "space"),
        (TOKEN, [], "--allowed-host"),
        (TOKEN, ["*"], "wildcard"),
        (TOKEN, ["http://bench.lab"], "without scheme"),
    ],
)
def test_the_network_is_not_let_in_by_oversight(
    token: str | None, names: list[str], said: str
) -> None:
    with pytest.raises(ConfigError, match=said):
        service_settings("0.0.0.0", 8000, token, names, "sqlite://")  # noqa: S104 - refused


def test_the_token_is_not_printed_with_the_settings() -> None:
    assert TOKEN not in repr(service_settings("127.0.0.1", 8000, TOKEN, [], "sqlite://"))
