"""The page's files come out of memory, whatever a request asks for."""

import re
from importlib.metadata import version
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from northfinder.service.problems import install_problems
from northfinder.service.static_files import page_files, static_routes
from tests.service.asking import ask

_CHECKOUT = Path(__file__).parents[2]
_PLOTLY = f"/static/plotly-{version('plotly')}.min.js"


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """A folder with a page, and with what is not to be shown."""
    folder = tmp_path / "web"
    (folder / "words").mkdir(parents=True)
    (folder / "index.html").write_text('<meta content="{{plotly_url}}">{{version}}')
    (folder / "app.js").write_text("export const answer = 42;\n" * 100)
    (folder / "words" / "zh.json").write_text('{"north": "北"}')
    (folder / ".secret.json").write_text("{}")
    (folder / "notes.md").write_text("not for the page")
    (tmp_path / "secret.json").write_text("{}")
    return folder


def get(folder: Path, path: str, **headers: str) -> httpx.Response:
    app = FastAPI(routes=static_routes(page_files(folder)), docs_url=None)
    install_problems(app)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return ask(app, "GET", path, {"Accept-Encoding": "identity", **named})


def test_the_page_learns_its_version_and_where_plotly_is(page: Path) -> None:
    answer = get(page, "/")
    assert answer.text == f'<meta content="{_PLOTLY}">{version("northfinder")}'
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert "script-src 'self';" in answer.headers["content-security-policy"]


def test_files_have_the_type_that_a_browser_insists_on(page: Path) -> None:
    script, words = get(page, "/static/app.js"), get(page, "/static/words/zh.json")
    assert script.headers["content-type"] == "text/javascript; charset=utf-8"
    assert words.headers["content-type"] == "application/json"
    assert words.json() == {"north": "北"}


@pytest.mark.parametrize(
    "path",
    ["/static/", "/static/../secret.json", "/static/%2e%2e/secret.json", "/static/..%2fsecret.json",
     "/static//etc/passwd", "/static/.secret.json", "/static/notes.md", "/static/APP.JS",
     "/static/app.js%00", "/static/index.html"],
)  # fmt: skip
def test_only_exact_names_are_found(page: Path, path: str) -> None:
    assert get(page, path).status_code == 404


def test_a_file_is_asked_for_again_but_sent_once(page: Path) -> None:
    first = get(page, "/static/app.js")
    assert first.headers["cache-control"] == "no-cache"
    again = get(page, "/static/app.js", If_None_Match=f'"x", W/{first.headers["etag"]}')
    assert (again.status_code, again.content) == (304, b"")
    assert again.headers["etag"] == first.headers["etag"]
    assert get(page, "/static/app.js", If_None_Match='"x"').status_code == 200


def test_files_are_compressed_for_who_can_read_it(page: Path) -> None:
    plain, zipped = get(page, "/static/app.js"), get(page, "/static/app.js", Accept_Encoding="gzip")
    assert zipped.headers["content-encoding"] == "gzip"
    assert zipped.text == plain.text
    assert int(zipped.headers["content-length"]) < len(plain.content)
    assert zipped.headers["etag"] != plain.headers["etag"]
    assert zipped.headers["vary"] == "Accept-Encoding"
    refused = get(page, "/static/app.js", Accept_Encoding="br, gzip;q=0.0")
    assert "content-encoding" not in refused.headers


def test_plotly_comes_from_its_wheel_and_is_kept_for_ever(page: Path) -> None:
    answer = get(page, _PLOTLY, Accept_Encoding="gzip")
    assert "immutable" in answer.headers["cache-control"]
    assert "plotly.js" in answer.text[:200]


def test_every_file_that_the_checkouts_page_names_is_served() -> None:
    files = page_files()
    page = files["/"].body.decode()
    assert set(re.findall(r'"(/static/[^"]*)"', page)) <= set(files)
    assert {path.name for path in (_CHECKOUT / "web").glob("*.js")} <= {
        path.removeprefix("/static/") for path in files
    }
