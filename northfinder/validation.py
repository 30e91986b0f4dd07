"""From what a person wrote to a checked model, or to sentences that say what is wrong."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from northfinder.errors import ConfigError

M = TypeVar("M", bound=BaseModel)


def validated(model: type[M], values: Mapping[str, Any], source: str) -> M:
    """Check values against a model; an unknown key's error names the nearest known one.

    Args:
        model: What they should be.
        values: As read; strings are converted, for the environment has nothing else.
        source: Where they come from, to begin the message with.

    Raises:
        ConfigError: With one sentence per mistake.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        sentences = "; ".join(_sentence(model, mistake) for mistake in error.errors())
        msg = f"{source}: {sentences}"
        raise ConfigError(msg) from None


def _sentence(model: type[BaseModel], mistake: Mapping[str, Any]) -> str:
    *sections, key = (str(part) for part in mistake["loc"])
    place = f"[{sections[0]}] {key}" if sections else key
    if mistake["type"] == "extra_forbidden":
        return f"{place} is unknown; {_suggestion(key, _keys(model, sections))}"
    if mistake["type"] == "literal_error":
        return f"{place} = {mistake['input']!r}: allowed are {mistake['ctx']['expected']}"
    reason = str(mistake["msg"]).removeprefix("Value error, ").removeprefix("Input ")
    return f"{place} = {mistake['input']!r}: {reason}"


def _keys(model: type[BaseModel], sections: list[str]) -> list[str]:
    if sections:
        section = model.model_fields[sections[0]].annotation
        return _keys(section, []) if isinstance(section, type) else []
    return [field.alias or name for name, field in model.model_fields.items()]


def _suggestion(key: str, known: Iterable[str]) -> str:
    near = get_close_matches(key, list(known), n=1, cutoff=0.5)
    return f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
