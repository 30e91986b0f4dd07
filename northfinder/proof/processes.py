"""The simulated instruments and the service as processes of their own, at real time."""

import asyncio
import json
import sys
from asyncio.subprocess import Process
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, NamedTuple

SERIAL = {"turntable": "zaber", "gyro": "kvh", "accelerometer": "stim300"}
#: The table is a node on a CAN bus behind an adapter, which is on a pseudo-terminal as well.
MIXED = {**SERIAL, "turntable": "cia402"}
_START_S = 30.0
_END_S = 10.0


class Served(NamedTuple):
    """A service that runs: its port on loopback, and its process."""

    port: int
    pid: int


@asynccontextmanager
async def simulated_instruments(
    folder: Path, drivers: dict[str, str] = SERIAL
) -> AsyncIterator[dict[str, str]]:
    """Serve the simulated instruments on pseudo-terminals; yields link by role."""
    config = _rig_file(folder / "sim.toml", drivers, dict.fromkeys(drivers, "sim:"))
    arguments = ("--config", str(config), "--serial", "pty", "--can", "slcan:pty")
    async with _northfinder("sim", *arguments) as instruments:
        links: dict[str, str] = {}
        while len(links) < len(drivers):
            announced = json.loads(await _line_of(instruments))
            links[announced["role"]] = announced["link"]
        yield links


@asynccontextmanager
async def service_of(
    links: dict[str, str], folder: Path, drivers: dict[str, str] = SERIAL
) -> AsyncIterator[Served]:
    """Serve the rig whose instruments are behind these links."""
    config = _rig_file(folder / "rig.toml", drivers, links)
    url = f"sqlite:///{(folder / 'records.db').as_posix()}"
    arguments = ("--config", str(config), "--port", "0", "--database", url)
    async with _northfinder("serve", *arguments, log=folder / "service.log") as service:
        yield Served(int((await _line_of(service)).rpartition(":")[2]), service.pid)


def _rig_file(file: Path, drivers: dict[str, str], links: dict[str, str]) -> Path:
    sections = ['[site]\nname = "Load"\nlatitude_deg = 40.0\n']
    for role, driver in drivers.items():
        sections.append(
            f"[{role}]\ndriver = {json.dumps(driver)}\nlink = {json.dumps(links[role])}\n"
        )
    file.write_text("\n".join(sections), encoding="utf-8")
    return file


@asynccontextmanager
async def simulated_service(folder: Path, speed: float) -> AsyncIterator[int]:
    """Serve the simulated rig, its time so many times real time; yields the port on loopback."""
    url = f"sqlite:///{(folder / 'records.db').as_posix()}"
    arguments = ("--port", "0", "--sim-speed", str(speed), "--database", url)
    async with _northfinder("serve", *arguments, log=folder / "service.log") as service:
        yield int((await _line_of(service)).rpartition(":")[2])


@asynccontextmanager
async def plain_service(
    answers: dict[str, dict[str, Any]], folder: Path
) -> AsyncIterator[tuple[int, int]]:
    """Serve these answers plainly; yields the ports of the app and of the bare bytes."""
    file = folder / "answers.json"
    file.write_text(json.dumps(answers), encoding="utf-8")
    async with _module("northfinder.proof.plain_service", str(file)) as service:
        app, bare = (await _line_of(service)).split()
        yield int(app), int(bare)


@asynccontextmanager
async def _northfinder(*arguments: str, log: Path | None = None) -> AsyncIterator[Process]:
    async with _module("northfinder", *arguments, log=log) as process:
        yield process


@asynccontextmanager
async def _module(name: str, *arguments: str, log: Path | None = None) -> AsyncIterator[Process]:
    command = (sys.executable, "-m", name, *arguments)
    stderr = None if log is None else log.open("wb")
    process = await asyncio.create_subprocess_exec(
        *command, stdout=asyncio.subprocess.PIPE, stderr=stderr
    )
    try:
        yield process
    finally:
        if process.returncode is None:
            process.terminate()
        async with asyncio.timeout(_END_S):
            await process.wait()
        if stderr is not None:
            stderr.close()


async def _line_of(process: Process) -> str:
    """Return the next line that a process announces something in."""
    if process.stdout is None:
        msg = "a process without an output cannot announce where it listens"
        raise RuntimeError(msg)
    async with asyncio.timeout(_START_S):
        line = await process.stdout.readline()
    if not line:
        msg = "a process of northfinder ended before it had announced where it listens"
        raise RuntimeError(msg)
    return line.decode().strip()
