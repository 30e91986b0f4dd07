"""The page's files, read once into memory: no path of a request ever reaches the file system."""

import gzip
import hashlib
import importlib.util
from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version as version_of
from pathlib import Path

from fastapi.routing import APIRoute
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute

import northfinder
from northfinder.errors import ConfigError
from northfinder.service import policies
from northfinder.service.problems import Problem
from northfinder.software import version

_MEDIA_TYPES = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".ico": "image/vnd.microsoft.icon",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".webmanifest": "application/manifest+json",
    ".woff2": "font/woff2",
}
_COMPRESSED = {".png", ".woff2"}
_PREFIX = "/static/"
ASK_AGAIN = "no-cache"  # kept, but never shown without asking whether it has changed
FOR_EVER = "public, max-age=31536000, immutable"


@dataclass(frozen=True, slots=True)
class StaticFile:
    """A file as it is sent, plain and compressed."""

    body: bytes
    zipped: bytes | None
    media_type: str
    etag: str
    cache_control: str
    policy: str

    @classmethod
    def of(
        cls, body: bytes, suffix: str, cache_control: str = ASK_AGAIN, policy: str = policies.PAGE
    ) -> "StaticFile":
        """Prepare what a file says to be sent."""
        zipped = None if suffix in _COMPRESSED else gzip.compress(body, compresslevel=6, mtime=0)
        return cls(
            body=body,
            zipped=zipped if zipped and len(zipped) < len(body) else None,
            media_type=_MEDIA_TYPES[suffix],
            etag=hashlib.sha256(body).hexdigest()[:32],
            cache_control=cache_control,
            policy=policy,
        )

    def response(self, request: Request) -> Response:
        """Answer a request, with 304 where the browser has the file already."""
        use_zipped = self.zipped is not None and _accepts_gzip(request)
        etag = f'"{self.etag}-gzip"' if use_zipped else f'"{self.etag}"'
        headers = {
            "ETag": etag,
            "Cache-Control": self.cache_control,
            "Content-Security-Policy": self.policy,
            "Vary": "Accept-Encoding",
        }
        known = request.headers.get("if-none-match", "")
        if etag in {tag.strip().removeprefix("W/") for tag in known.split(",")}:
            return Response(status_code=304, headers=headers)
        if use_zipped and self.zipped is not None:
            headers["Content-Encoding"] = "gzip"
            return Response(self.zipped, headers=headers, media_type=self.media_type)
        return Response(self.body, headers=headers, media_type=self.media_type)


def _accepts_gzip(request: Request) -> bool:
    for offer in request.headers.get("accept-encoding", "").lower().split(","):
        coding, _, weight = offer.replace(" ", "").partition(";q=")
        if coding in {"gzip", "*"}:
            return weight.strip("0.") != "" or not weight
    return False


def page_files(folder: Path | None = None) -> dict[str, StaticFile]:
    """Read the page's files and Plotly, by the path that each is asked for by.

    Args:
        folder: Where the page is; by default this checkout's, or the installed package's copy.

    Raises:
        ConfigError: There is no page.
    """
    folder = folder or _web_folder()
    plotly_url, plotly = _plotly()
    files = {plotly_url: plotly}
    for path in _files_below(folder):
        name = path.relative_to(folder).as_posix()
        files[f"{_PREFIX}{name}"] = StaticFile.of(path.read_bytes(), path.suffix)
    page = (folder / "index.html").read_text(encoding="utf-8")
    page = page.replace("{{plotly_url}}", plotly_url).replace("{{version}}", version())
    files["/"] = StaticFile.of(page.encode(), ".html")
    del files[f"{_PREFIX}index.html"]  # it has one address
    return files


def _files_below(folder: Path) -> Iterator[Path]:
    """Yield the files that are the page's; a folder or file with a leading dot is not."""
    for path in sorted(folder.rglob("*")):
        is_hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if path.is_file() and not is_hidden and path.suffix in _MEDIA_TYPES:
            yield path


def _web_folder() -> Path:
    """Return the checkout's folder beside the package, or the copy that a wheel carries in it."""
    package = Path(northfinder.__file__).parent
    for folder in (package / "web", package.parent / "web"):
        if (folder / "index.html").is_file():
            return folder
    msg = f"the page is missing: {package.parent / 'web'} holds no index.html; install again"
    raise ConfigError(msg)


def _plotly() -> tuple[str, StaticFile]:
    """Return Plotly's script out of its wheel, and a path that changes with its version."""
    package = importlib.util.find_spec("plotly")  # which does not import all of it
    if package is None or package.origin is None:
        msg = "the charts are missing: the package plotly is not installed; install again"
        raise ConfigError(msg)
    script = Path(package.origin).parent / "package_data" / "plotly.min.js"
    file = StaticFile.of(script.read_bytes(), ".js", cache_control=FOR_EVER)
    return f"{_PREFIX}plotly-{version_of('plotly')}.min.js", file


def static_routes(files: Mapping[str, StaticFile]) -> list[BaseRoute]:
    """Return the routes of files whose paths are ``/`` and those below ``/static/``."""

    async def answer(request: Request) -> Response:
        path = request.url.path
        if path not in files:
            raise Problem(404, None, f"The page has no file {path[:100]}.")
        return files[path].response(request)

    return [file_route("/", answer), file_route(f"{_PREFIX}{{name:path}}", answer)]


def file_route(path: str, answer: Callable[[Request], Awaitable[Response]]) -> APIRoute:
    """Return the route of something that is no part of the API."""
    return APIRoute(path, answer, methods=["GET", "HEAD"], include_in_schema=False)
