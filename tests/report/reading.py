"""A certificate as a strict reader takes it in."""

import re
from decimal import Decimal
from html.parser import HTMLParser
from xml.etree import ElementTree as ET

VOID = {"meta", "link", "br", "hr", "img", "input"}


class Page(HTMLParser):
    """Every element in its place; HTML's own parser would forgive."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []
        self.ids: list[str] = []
        self.texts: list[str] = []
        self.feed(html)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append(tag)
        self.ids += [value or "" for name, value in attrs if name == "id"]
        assert not [name for name, _ in attrs if name.startswith("on") or name == "src"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:  # noqa: ARG002
        self.seen.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag
        if tag in {"td", "th", "dt", "dd", "p", "caption"}:
            self.texts.append(" ")

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join("".join(self.texts).split())


def figures_of(html: str) -> int:
    """Count the figures of a page that is well formed, and fetches and runs nothing."""
    page = Page(html)
    assert not {"script", "link", "img", "iframe", "object", "form"} & set(page.seen)
    assert len(page.ids) == len(set(page.ids)), "ids of two figures collide"
    namespaces = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert set(re.findall(r"https?://[^\"' <]*", html)) <= namespaces
    assert "@import" not in html
    assert set(re.findall(r"url\(([^)]{2})", html)) <= {"#p", "#m"}
    figures = re.findall(r"<figure[^>]*>(<svg.*?</svg>)\s*</figure>", html, flags=re.DOTALL)
    assert len(figures) == page.seen.count("figure")
    return len([ET.fromstring(figure) for figure in figures])  # noqa: S314 -- our own text


def north_of(text: str) -> tuple[Decimal, Decimal]:
    """Return the azimuth and its U as they stand in print."""
    found = re.search(r"([\d.]+)° ± ([\d.]+)° U, k = 2", text)
    assert found, "no azimuth is stated"
    return Decimal(found[1]), Decimal(found[2])


def assert_agrees(printed: str | Decimal, exact: float) -> None:
    """A number in print is the exact one, rounded."""
    number = Decimal(str(printed).replace("−", "-"))
    half_a_digit = 0.5001 * 10.0 ** int(number.as_tuple().exponent)
    assert abs(float(number) - exact) <= half_a_digit, (printed, exact)
