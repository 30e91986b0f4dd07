"""Who carries a run out: a process that can be told from every other one."""

import json
import socket
from dataclasses import asdict, dataclass
from typing import Self

import psutil

# A process's start is kept from the boot's, which the kernel shifts as it disciplines its clock.
_START_TOLERANCE_S = 2.0


@dataclass(frozen=True, slots=True)
class Holder:
    """A process, told from a later one of the same number by its start.

    Attributes:
        host: The name of its computer.
        pid: Its number there.
        started_s: When it started, seconds since 1970, by its computer's clock.
    """

    host: str
    pid: int
    started_s: float

    @classmethod
    def this_process(cls) -> Self:
        """Return the calling process."""
        process = psutil.Process()
        return cls(socket.gethostname(), process.pid, process.create_time())

    def is_gone(self) -> bool:
        """Return whether the process has certainly ended; of another computer nobody knows."""
        if self.host != socket.gethostname():
            return False
        try:
            process = psutil.Process(self.pid)
            if process.status() == psutil.STATUS_ZOMBIE:
                return True  # killed, and its parent has not looked yet
            return abs(process.create_time() - self.started_s) > _START_TOLERANCE_S
        except psutil.NoSuchProcess:
            return True
        except psutil.AccessDenied:  # it is there, another user's
            return False

    def to_text(self) -> str:
        """Encode for a column; equal holders give equal texts."""
        return json.dumps(asdict(self))

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Decode what :meth:`to_text` wrote."""
        return cls(**json.loads(text))

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}"
