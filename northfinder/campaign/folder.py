"""Where a campaign is kept while it runs and afterwards; begun again, it goes on."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Self

import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import parquet

from northfinder.campaign.chunks import Columns
from northfinder.campaign.settings import SEEKS_PER_CHUNK, Campaign
from northfinder.campaign.tally import covered
from northfinder.errors import ConfigError
from northfinder.software import version

_SETTINGS, _SEEKS, _CHUNKS = "campaign.json", "seeks.parquet", "chunks"


class CampaignFolder:
    """One campaign's folder: its settings, its chunks, and at the end all seeks in one file.

    Args:
        path: The folder; made by :meth:`open`.
        campaign: What it is of.
    """

    def __init__(self, path: Path, campaign: Campaign) -> None:
        self.path = path
        self._campaign = campaign

    @classmethod
    def open(cls, path: Path, campaign: Campaign) -> Self:
        """Begin a campaign in a folder, or go on with the same one there.

        Raises:
            ConfigError: The folder holds another campaign, or cannot be written.
        """
        folder, identity = cls(path, campaign), _identity(campaign)
        try:
            (path / _CHUNKS).mkdir(parents=True, exist_ok=True)
            if not (path / _SETTINGS).exists():
                _write_whole(path / _SETTINGS, json.dumps(identity, indent=1).encode())
            there = json.loads((path / _SETTINGS).read_text(encoding="utf-8"))
        except OSError as error:
            msg = f"--output {path}: the folder cannot be used: {error.strerror}"
            raise ConfigError(msg) from error
        except ValueError as error:
            msg = f"--output {path}: {_SETTINGS} there is no campaign's: take another folder"
            raise ConfigError(msg) from error
        _check_same(path, there, identity)
        return folder

    @property
    def seeks_file(self) -> Path:
        """Return where all seeks are, once the campaign is complete."""
        return self.path / _SEEKS

    @property
    def complete(self) -> bool:
        """Say whether all seeks are in one file."""
        return self.seeks_file.exists()

    def finished(self) -> set[int]:
        """Return the numbers of the chunks that are kept."""
        if self.complete:
            return set(range(self._campaign.chunks))
        return {int(file.stem) for file in (self.path / _CHUNKS).glob("*.parquet")}

    @property
    def kept_seeks(self) -> int:
        """Return how many seeks are kept."""
        return sum(self._campaign.seeks_in(chunk) for chunk in self.finished())

    def keep(self, chunk: int, columns: Columns) -> None:
        """Keep a chunk, whole or not at all."""
        file = self._chunk_file(chunk)
        beside = file.with_suffix(".part")
        parquet.write_table(_table(columns), beside, **_WRITING)
        beside.replace(file)

    def merge(self) -> None:
        """Put all chunks into one file, in their order, a row group each, and drop them."""
        if self.complete:
            return
        beside = self.seeks_file.with_suffix(".part")
        with parquet.ParquetWriter(beside, _SCHEMA, **_WRITING) as writer:
            for chunk in range(self._campaign.chunks):
                writer.write_table(parquet.read_table(self._chunk_file(chunk)))
        beside.replace(self.seeks_file)
        for chunk in range(self._campaign.chunks):
            self._chunk_file(chunk).unlink()

    def chunks(self) -> Iterator[Columns]:
        """Read the columns of a complete campaign, chunk by chunk."""
        with parquet.ParquetFile(self.seeks_file) as file:
            for group in range(file.num_row_groups):
                table = file.read_row_group(group)
                yield {name: table[name].to_numpy() for name in table.column_names}

    def _chunk_file(self, chunk: int) -> Path:
        return self.path / _CHUNKS / f"{chunk:06d}.parquet"


_NAMES = (
    *("true_azimuth_deg", "true_pitch_deg", "true_roll_deg"),
    *("azimuth_deg", "vector_azimuth_deg", "pitch_deg", "roll_deg"),
    *("azimuth_sigma_deg", "interval95_half_width_deg", "error_deg", "bound_deg", "dof"),
)
_TYPES: dict[str, pa.DataType] = {**dict.fromkeys(_NAMES, pa.float64()), "covered": pa.bool_()}
_SCHEMA = pa.schema(_TYPES)
#: Noise does not compress.
_WRITING: dict[str, Any] = {"compression": "none", "use_dictionary": False}


def _table(columns: Columns) -> pa.Table:
    values: dict[str, NDArray[Any]] = {**columns, "covered": covered(columns)}
    arrays = [pa.array(values[field.name], field.type) for field in _SCHEMA]
    return pa.Table.from_arrays(arrays, schema=_SCHEMA)


def _identity(campaign: Campaign) -> dict[str, Any]:
    """Return all that decides the numbers, as JSON."""
    settings: dict[str, Any] = json.loads(campaign.model_dump_json())
    return {**settings, "seeks_per_chunk": SEEKS_PER_CHUNK, "software": version()}


def _check_same(path: Path, there: Any, here: dict[str, Any]) -> None:  # noqa: ANN401 (read from a file)
    other = _first_difference(there, here)
    if other is not None:
        msg = (
            f"--output {path} holds a campaign with other settings ({other}): "
            "give the same ones to go on with it, or another folder"
        )
        raise ConfigError(msg)


def _first_difference(there: Any, here: Any, key: str = "") -> str | None:  # noqa: ANN401 (JSON)
    """Name the first value that differs; None where all are equal."""
    if there == here:
        return None
    if isinstance(there, dict) and isinstance(here, dict):
        differing = (name for name in {**here, **there} if there.get(name) != here.get(name))
        name = next(differing)
        return _first_difference(there.get(name), here.get(name), f"{key}.{name}".lstrip("."))
    if isinstance(there, list | dict) or isinstance(here, list | dict):
        return key or "settings"
    return f"{key} = {there} there, {here} here"


def _write_whole(file: Path, content: bytes) -> None:
    beside = file.with_suffix(".part")
    beside.write_bytes(content)
    beside.replace(file)
