"""What is wrong with a request, field by field, in words; never more than a few lines of them."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from fastapi.exceptions import RequestValidationError

_MISTAKES = 20  # a body of 64 kB has room for thousands
_TOLD = 3  # of them in the sentence
_FIELD_CHARACTERS = 100
_MESSAGE_CHARACTERS = 300
_VALUE_CHARACTERS = 40


class Mistake(NamedTuple):
    """One field and what is wrong with it."""

    field: str
    message: str


def mistakes_of(error: RequestValidationError) -> list[Mistake]:
    """Return what pydantic found, a sentence's rest each: ``should be less than 720, not 900``."""
    return [_mistake(found, error.body) for found in error.errors()[:_MISTAKES]]


def unreadable(cause: BaseException) -> list[Mistake]:
    """Return what is wrong with a body that JSON's parser gave up on: bytes, depth, digits."""
    reasons = {
        UnicodeDecodeError: "is not text in UTF-8",
        RecursionError: "is nested too deeply",
    }
    reason = reasons.get(type(cause), "is no JSON that can be read")
    return [Mistake("body", f"{reason}: send one JSON object")]


def sentence_about(mistakes: Sequence[Mistake]) -> str:
    """Return the first mistakes as one sentence."""
    told = [f"{mistake.field} {mistake.message}" for mistake in mistakes[:_TOLD]]
    if len(mistakes) > _TOLD:
        told.append(f"and {len(mistakes) - _TOLD} more")
    return f"{'; '.join(told)}."


def _mistake(found: Mapping[str, Any], body: Any) -> Mistake:  # noqa: ANN401 - whatever was sent
    place = found["loc"]
    if found["type"] == "json_invalid":  # fastapi's place is then a character, not a field
        _, character = place
        message = f"is no JSON: {found['ctx']['error']} at character {character + 1}"
        return Mistake("body", message)
    if found["type"].startswith("union_tag"):  # the place is then that of the whole object
        return _unknown_branch(found, ".".join(_names(place, body)))
    field = ".".join(_names(place, body))
    return Mistake(field[:_FIELD_CHARACTERS], _message(found)[:_MESSAGE_CHARACTERS])


def _unknown_branch(found: Mapping[str, Any], whole: str) -> Mistake:
    """Name the field that says which kind of object it is."""
    context = found["ctx"]
    field = f"{whole}.{context['discriminator'].strip(chr(39))}"
    if found["type"] == "union_tag_not_found":
        return Mistake(field, "is required")
    value = _instead(context["tag"])
    return Mistake(
        field, f"should be one of {context['expected_tags']}{value}"[:_MESSAGE_CHARACTERS]
    )


def _names(place: Sequence[str | int], body: Any) -> Iterator[str]:  # noqa: ANN401
    """Yield the way to a field, without the branches of unions, which are no part of the body."""
    whole, *below = place
    yield str(whole)
    here = body if whole == "body" else None
    for number, part in enumerate(below, start=1):
        is_branch = isinstance(here, Mapping) and part not in here and number < len(below)
        if not is_branch:
            here = _at(here, part)
            yield str(part)


def _at(here: Any, part: str | int) -> Any:  # noqa: ANN401
    if isinstance(here, Mapping) and isinstance(part, str):
        return here.get(part)
    if isinstance(here, list) and isinstance(part, int) and part < len(here):
        return here[part]
    return None


def _message(found: Mapping[str, Any]) -> str:
    value, kind = found.get("input"), found["type"]
    if kind == "missing":
        return "is required"
    if kind == "extra_forbidden":
        return "is not a known field"
    if isinstance(value, bytes):  # fastapi leaves a body alone that does not claim to be JSON
        return "has to be JSON, sent with the header Content-Type: application/json"
    reason = str(found["msg"]).removeprefix("Value error, ").removeprefix("Input ")
    return f"{reason}{_instead(value)}"


def _instead(value: Any) -> str:  # noqa: ANN401
    """Name a value that is small enough to be repeated."""
    if isinstance(value, (str, int, float, bool, type(None))):
        written = json.dumps(value)
        if len(written) <= _VALUE_CHARACTERS:
            return f", not {written}"
    return ""
