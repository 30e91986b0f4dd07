"""The threats of docs/threats.md that no other test tries, on the service as it is started."""

import csv
import io
import json
import re
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
from pyarrow import parquet

from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.service.patience import MOST_CONNECTIONS, REQUEST_S
from northfinder.service.sessions import COOKIE
from northfinder.wiring import build_rig
from tests.service.asking import ask
from tests.service.process import SHORT, ServiceProcess, serving, wait_until_ready
from tests.service.shell_app import TOKEN, shell_app

NAME = '=HYPERLINK("http://evil.example")<script>alert(1)</script>\r\nX-Evil: 1'
WEB = Path(__file__).parents[2] / "web"
_FORMULA = re.compile(r"[=@+]|-(?![0-9.])")  # what a spreadsheet takes for one; not a number


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """A service whose rig has a name that wants to be a formula, a script and a header."""
    folder = tmp_path_factory.mktemp("threats")
    with serving(folder, NORTHFINDER_SITE__NAME=NAME) as service:
        wait_until_ready(service)
        yield service


@pytest.fixture(scope="module")
def run_id(hostile: ServiceProcess) -> str:
    run_id = hostile.start(SHORT)
    assert hostile.wait(run_id)["state"] == "completed"
    return run_id


def raw(service: ServiceProcess, request: bytes, timeout_s: float = 5.0) -> bytes:
    """Send bytes as they are, and return the answer's head."""
    with connected(service) as connection:
        connection.settimeout(timeout_s)
        connection.sendall(request)
        return connection.recv(1 << 16)


def connected(service: ServiceProcess) -> socket.socket:
    address = urlsplit(service.address)
    assert address.hostname is not None
    assert address.port is not None
    return socket.create_connection((address.hostname, address.port), 5.0)


# A request that wants what is not its own


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [
        "/api/v1/runs/..%2f..%2f..%2fetc%2fpasswd",
        "/api/v1/runs/%2e%2e/%2e%2e/%2e%2e/etc/passwd",
        "/api/v1/runs/{run_id}/figures/..%2f..%2fetc%2fpasswd.svg",
        "/api/v1/runs/{run_id}/figures/%00.svg",
        "/api/v1/studies/..%2f..%2fpyproject.toml",
        "/..%2fpyproject.toml",
        "/../../../../etc/passwd",
        "//etc/passwd",
        "/.%00./records.db",
    ],
)
def test_no_path_leads_out(hostile: ServiceProcess, run_id: str, path: str) -> None:
    target = path.replace("{run_id}", run_id)
    answer = raw(hostile, f"GET {target} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    assert answer.startswith(b"HTTP/1.1 404"), answer[:200]
    assert b"root:" not in answer


@pytest.mark.slow
@pytest.mark.parametrize(
    "head",
    [
        b"POST /api/v1/runs HTTP/1.1\r\nHost: localhost\r\nIdempotency-Key: a\rX-Evil: 1\r\n",
        b"GET /api/v1/runs/x%0d%0aX-Evil:%201 HTTP/1.1\r\nHost: localhost\r\n",
        b"GET /api/v1/runs?cursor=x%0d%0aX-Evil:%201 HTTP/1.1\r\nHost: localhost\r\n",
        b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n",
        b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\nContent-Length: 5\r\n",
    ],
)
def test_no_header_is_smuggled_in(hostile: ServiceProcess, head: bytes) -> None:
    answer = raw(hostile, head + b"\r\n").partition(b"\r\n\r\n")[0].lower()
    assert re.match(rb"http/1\.1 4\d\d", answer), answer
    assert b"\nx-evil" not in answer


@pytest.mark.slow
def test_a_head_without_end_is_cut_off(hostile: ServiceProcess) -> None:
    answer = raw(hostile, b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"x" * 200_000)
    assert answer.startswith(b"HTTP/1.1 4")


# What a name may become


@pytest.mark.slow
def test_no_export_holds_a_formula(hostile: ServiceProcess, run_id: str) -> None:
    for path in ("samples?format=csv", "visits?format=csv"):
        answer = hostile.api.get(f"/runs/{run_id}/{path}")
        rows = list(csv.reader(io.StringIO(answer.text)))
        assert len(rows) > 4
        assert not [cell for row in rows for cell in row if _FORMULA.match(cell)]
        assert run_id in answer.headers["content-disposition"]
        assert "evil" not in str(answer.headers).lower()
    table = hostile.api.get(f"/runs/{run_id}/samples?format=parquet").content
    assert parquet.read_schema(io.BytesIO(table)).metadata[b"run_id"] == run_id.encode()


@pytest.mark.slow
def test_a_name_is_text_in_every_document(hostile: ServiceProcess, run_id: str) -> None:
    """The certificate and each figure: escaped, and by their policy unable to run anything."""
    for path in ("report.html", "figures/fit.svg", "figures/dial.svg", "figures/budget.svg"):
        answer = hostile.api.get(f"/runs/{run_id}/{path}")
        assert answer.status_code == 200
        assert "<script" not in answer.text
        assert "script-src" not in answer.headers["content-security-policy"]
        assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert "&lt;script&gt;" in hostile.api.get(f"/runs/{run_id}/report.html").text


@pytest.mark.slow
@pytest.mark.usefixtures("run_id")
def test_a_name_begins_no_line_of_the_log(hostile: ServiceProcess) -> None:
    assert hostile.api.get("/rig").json()["name"] == NAME
    for line in hostile.log.read_text().splitlines():
        assert "message" in json.loads(line)


def test_the_page_makes_markup_of_no_string() -> None:
    """Names, identities and signals reach it as JSON: text nodes only; Plotly gets none of them."""
    sinks = r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function|srcdoc"
    sources = list(WEB.glob("*.js"))
    assert len(sources) > 20
    for source in sources:
        assert not re.search(sinks, source.read_text(encoding="utf-8")), source.name


# A browser that is lured


def test_a_session_that_was_planted_is_never_the_one_that_is_opened() -> None:
    """Fixation: the secret is made at signing in, whatever cookie the browser came with."""
    app, planted = shell_app(token=TOKEN), {"Cookie": f"{COOKIE}=planted-by-the-attacker"}
    opened = ask(app, "POST", "/api/v1/session", planted, json={"token": TOKEN})
    assert opened.status_code == 204
    assert opened.cookies[COOKIE] != "planted-by-the-attacker"
    assert len(opened.cookies[COOKIE]) >= 32
    assert ask(app, "GET", "/api/v1/runs/7", planted).status_code == 401
    again = ask(app, "POST", "/api/v1/session", planted, json={"token": TOKEN})
    assert again.cookies[COOKIE] != opened.cookies[COOKIE]


# A client that takes every place


UNENDING = (
    b"",
    b"GET /healthz HT",
    b"POST /api/v1/plans HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n{",
    b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\nGET /he",
)


@pytest.mark.slow
def test_a_request_that_never_ends_loses_its_connection(hostile: ServiceProcess) -> None:
    """Slowloris: uvicorn alone would wait for ever for nothing, half a head, half a body."""
    begun_s = time.monotonic()
    with ExitStack() as stack:
        connections = [stack.enter_context(connected(hostile)) for _ in UNENDING]
        for connection, said in zip(connections, UNENDING, strict=True):
            connection.sendall(said)
        for connection in connections:
            connection.settimeout(REQUEST_S + 5.0)
            while not refused(connection):
                pass
    assert REQUEST_S - 1.0 < time.monotonic() - begun_s < REQUEST_S + 5.0


@pytest.mark.slow
def test_the_rig_can_be_stopped_while_a_stranger_takes_every_place(tmp_path: Path) -> None:
    """Streams for ever, up to the limit: who is connected goes on, the next is turned away."""
    with serving(tmp_path) as service, ExitStack() as places:
        wait_until_ready(service)
        page = places.enter_context(one_connection(service))
        assert page.get("/rig").status_code == 200  # the technician's page is here first
        failed = keep_asking(page, places)
        streams = [places.enter_context(connected(service)) for _ in range(MOST_CONNECTIONS + 50)]
        for stream in streams[:-1]:
            stream.sendall(b"GET /api/v1/rig/events HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert page.post("/rig/stop").status_code == 200
        streams[-1].settimeout(5.0)
        assert refused(streams[-1])
        assert not failed.is_set()
    with pytest.raises(httpx.ConnectError):
        httpx.get(f"{service.address}/healthz")


def one_connection(service: ServiceProcess) -> httpx.Client:
    """Return a client that opens no second connection while its first is busy."""
    limits = httpx.Limits(max_connections=1)
    return httpx.Client(base_url=service.api.base_url, limits=limits, timeout=30.0)


def keep_asking(page: httpx.Client, places: ExitStack) -> threading.Event:
    """Ask for the rig every second, as the page does; set where that fails."""
    failed, over = threading.Event(), threading.Event()

    def ask_on() -> None:
        while not over.wait(1.0):
            if page.get("/rig").status_code != 200:
                failed.set()

    thread = threading.Thread(target=ask_on)
    thread.start()
    places.callback(thread.join)
    places.callback(over.set)
    return failed


def refused(stream: socket.socket) -> bool:
    try:
        return stream.recv(1) == b""
    except ConnectionResetError:
        return True


# A file that lies


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (" " * 16_000_001, "larger than 16,000,000 bytes"),
        ("\x00" * 1000, "no DBC file"),
        ("BO_ 1 FOG_RATE: 8 X\n" + " SG_ " * 10_000, "no DBC file"),
    ],
    ids=["huge", "binary", "endless"],
)
def test_a_dbc_file_that_lies_is_refused_in_a_sentence(
    tmp_path: Path, text: str, said: str
) -> None:
    file = tmp_path / "hostile.dbc"
    file.write_text(text, encoding="cp1252")
    config = RigConfig.model_validate(
        {"gyro": {"driver": "dbc", "file": str(file), "message": "FOG_RATE", "signal": "rate"}}
    )
    with pytest.raises(ConfigError, match=said):
        build_rig(config)


# The page itself


def test_every_test_that_the_page_names_is_there() -> None:
    tests = Path(__file__).parents[1]
    page = (tests.parent / "docs" / "threats.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:[a-z]+/)*)(test_\w+\.py)(?:::(test_\w+))?`", page)
    assert len(named) > 20
    for folder, file, test in named:
        path = tests / (folder or "service/") / file
        if not path.exists():
            path = tests / file  # one that stands above the folders
        assert f"def {test}" in path.read_text(encoding="utf-8"), (file, test)
