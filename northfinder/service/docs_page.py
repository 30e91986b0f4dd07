"""``/docs``: the API to read and to try, without anything from elsewhere."""

import importlib.util
import re
from pathlib import Path

from fastapi.openapi.docs import get_swagger_ui_html
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute

from northfinder.errors import ConfigError
from northfinder.service import policies
from northfinder.service.static_files import StaticFile, file_route

PATH = "/docs"
_FILES = ("swagger-ui-bundle.js", "swagger-ui.css", "favicon.png")
_INLINE_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)


def docs_routes(title: str, openapi_url: str) -> list[BaseRoute]:
    """Return the routes of the page and of Swagger's files, read once from their package.

    Args:
        title: The page's.
        openapi_url: Where the OpenAPI document is.

    Raises:
        ConfigError: The package with Swagger's files is not installed.
    """
    files = {f"{PATH}/{name}": _file(name) for name in _FILES}
    files[PATH] = _page(title, openapi_url)

    async def answer(request: Request) -> Response:
        return files[request.url.path].response(request)

    return [file_route(path, answer) for path in files]


def _page(title: str, openapi_url: str) -> StaticFile:
    page = bytes(
        get_swagger_ui_html(
            openapi_url=openapi_url,
            title=title,
            swagger_js_url=f"{PATH}/{_FILES[0]}",
            swagger_css_url=f"{PATH}/{_FILES[1]}",
            swagger_favicon_url=f"{PATH}/{_FILES[2]}",
            swagger_ui_parameters={"validatorUrl": None},  # Swagger's own, on the internet
        ).body
    )
    (script,) = _INLINE_SCRIPT.findall(page.decode())
    return StaticFile.of(page, ".html", policy=policies.page_with_script(script))


def _file(name: str) -> StaticFile:
    package = importlib.util.find_spec("fastapi_offline")
    if package is None or package.origin is None:
        msg = "the page /docs is missing: the package fastapi-offline is not installed"
        raise ConfigError(msg)
    file = Path(package.origin).parent / "static" / name
    return StaticFile.of(file.read_bytes(), file.suffix)
