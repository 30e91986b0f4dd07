"""``/docs`` needs nothing from elsewhere, and runs no script but its own."""

import base64
import hashlib
import re

from fastapi import FastAPI

from northfinder.service.docs_page import docs_routes
from tests.service.asking import ask

_APP = FastAPI(routes=docs_routes("northfinder", "/openapi.json"), docs_url=None)


def test_every_file_of_the_page_is_served_here() -> None:
    page = ask(_APP, "GET", "/docs").text
    assert not re.search(r"https?://", page)
    named = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert len(named) == 3
    for path in named:
        assert ask(_APP, "GET", path).status_code == 200, path


def test_the_stylesheet_loads_nothing() -> None:
    style = ask(_APP, "GET", "/docs/swagger-ui.css").text
    assert all(url.startswith("data:") for url in re.findall(r"url\([\"']?([^)]{5})", style))
    assert "@import" not in style


def test_the_policy_allows_the_pages_one_script() -> None:
    answer = ask(_APP, "GET", "/docs")
    (script,) = re.findall(r"<script>(.*?)</script>", answer.text, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = answer.headers["content-security-policy"]
    assert f"script-src 'self' 'sha256-{digest}';" in policy
