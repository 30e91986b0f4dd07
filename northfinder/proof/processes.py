"""The simulated instruments and the service as processes of their own, at real time."""

import asyncio
import json
import sys
from asyncio.subprocess import Process
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

_DRIVERS = {"turntable": "zaber", "gyro": "kvh", "accelerometer": "stim300"}
_START_S = 30.0
_END_S = 10.0


@asynccontextmanager
async def simulated_instruments() -> AsyncIterator[dict[str, str]]:
    """Serve the simulated instruments on pseudo-terminals; yields link by role."""
    async with _northfinder("sim", "--serial", "pty") as instruments:
        links: dict[str, str] = {}
        while len(links) < len(_DRIVERS):
            announced = json.loads(await _line_of(instruments))
            links[announced["role"]] = announced["link"]
        yield links


@asynccontextmanager
async def service_of(links: dict[str, str], folder: Path) -> AsyncIterator[int]:
    """Serve the rig whose instruments are behind these links; yields the port on loopback."""
    config = folder / "rig.toml"
    sections = ['[site]\nname = "Load"\nlatitude_deg = 40.0\n']
    for role, driver in _DRIVERS.items():
        sections.append(
            f"[{role}]\ndriver = {json.dumps(driver)}\nlink = {json.dumps(links[role])}\n"
        )
    config.write_text("\n".join(sections), encoding="utf-8")
    url = f"sqlite:///{(folder / 'records.db').as_posix()}"
    arguments = ("--config", str(config), "--port", "0", "--database", url)
    async with _northfinder("serve", *arguments, log=folder / "service.log") as service:
        yield int((await _line_of(service)).rpartition(":")[2])


@asynccontextmanager
async def _northfinder(*arguments: str, log: Path | None = None) -> AsyncIterator[Process]:
    command = (sys.executable, "-m", "northfinder", *arguments)
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
