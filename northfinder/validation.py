"""From what a person wrote to a checked model, or to sentences that say what is wrong."""

from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from northfinder.errors import ConfigError

M = TypeVar("M", bound=BaseModel)

#: Which source a value came from, by its place in the model.
SourceOf = Callable[[tuple[str, ...]], str]


def validated(model: type[M], values: Mapping[str, Any], source: str | SourceOf) -> M:
    """Check values against a model; an unknown key's error names the nearest known one.

    Args:
        model: What they should be.
        values: As read; strings are converted, for the environment has nothing else.
        source: Where they come from, to begin each sentence with.

    Raises:
        ConfigError: With one sentence per mistake.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        sentences = []
        for mistake in error.errors():
            place = tuple(str(part) for part in mistake["loc"])
            origin = source if isinstance(source, str) else source(place)
            sentences.append(f"{origin}: {_sentence(model, place, mistake)}")
        raise ConfigError("; ".join(sentences)) from None


def _sentence(model: type[BaseModel], place: tuple[str, ...], mistake: Mapping[str, Any]) -> str:
    reason = str(mistake["msg"]).removeprefix("Value error, ").removeprefix("Input ")
    if not place:  # of the model as a whole
        return reason
    *sections, key = place
    name = f"[{sections[0]}] {key}" if sections else key
    if mistake["type"] == "extra_forbidden":
        return f"{name} is unknown; {_suggestion(key, _keys(model, sections))}"
    if mistake["type"] == "literal_error":
        return f"{name} = {mistake['input']!r}: allowed are {mistake['ctx']['expected']}"
    if mistake["type"] == "model_type":
        return f"{name} = {mistake['input']!r}: this is a section; write [{name}] and keys below it"
    return f"{name} = {mistake['input']!r}: {reason}"


def _keys(model: type[BaseModel], sections: list[str]) -> list[str]:
    if sections:
        section = model.model_fields[sections[0]].annotation
        return _keys(section, []) if isinstance(section, type) else []
    return [field.alias or name for name, field in model.model_fields.items()]


def _suggestion(key: str, known: Iterable[str]) -> str:
    near = get_close_matches(key, list(known), n=1, cutoff=0.5)
    return f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
