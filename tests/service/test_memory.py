"""What was freed goes back to the system while the service stands."""

import asyncio
import platform
import subprocess
import sys
import time

import psutil
import pytest

from northfinder.service import memory

pytestmark = pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="others do it themselves")


def rss_mb() -> float:
    return psutil.Process().memory_info().rss / 1e6


def test_what_lies_between_pieces_in_use_is_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """glibc itself gives back only what lies at an arena's end."""
    monkeypatch.setattr(memory, "_EVERY_S", 0.01)
    pieces = [bytearray(4096) for _ in range(25_000)]
    in_use = pieces.pop()
    del pieces
    kept_mb = rss_mb()

    async def until_it_falls() -> None:
        giving = asyncio.create_task(memory.keep_giving_back())
        deadline_s = time.monotonic() + 30.0
        while rss_mb() > kept_mb - 80.0:
            assert time.monotonic() < deadline_s, f"{kept_mb:.0f} MB have become {rss_mb():.0f}"
            await asyncio.sleep(0.01)
        giving.cancel()

    asyncio.run(until_it_falls())
    assert len(in_use) == 4096


def test_a_collection_leaves_out_what_the_start_has_made() -> None:
    """In a process of its own: nothing of pytest's shall stay for ever."""
    code = """
import gc, weakref
from northfinder.service.memory import set_the_start_apart
import northfinder.service.app
class Ring: pass
set_the_start_apart()
ring = Ring(); ring.itself = ring; gone = weakref.ref(ring); del ring
gc.collect()
print(gone() is None, len(gc.get_objects()) < 0.1 * gc.get_freeze_count())
"""
    told = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert told.stdout.split() == ["True", "True"]


def test_exports_take_their_memory_from_the_c_library() -> None:
    """In a process of its own: Arrow asks once, and here somebody may have imported it before."""
    code = (
        "import northfinder.cli.serving, pyarrow; print(pyarrow.default_memory_pool().backend_name)"
    )
    told = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert told.stdout.strip() == "system"
