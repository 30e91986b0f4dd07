"""STIM300's service mode: a terminal dialogue that ends every answer with a prompt.

TS1524 sections 7.5.3 and 9. The instrument echoes each command, answers in lines that end with
CR, reports errors as ``E`` and three digits, and prompts. A change that is not saved with ``s``
holds until the power goes.
"""

import re

ENTER = b"SERVICEMODE\r"
PROMPT = b"\r>"

#: Back to normal mode at once, unsaved changes kept and no question asked (table 9-54).
EXIT = b"x N\r"

_ERROR = re.compile(rb"(?:^|\r)(E\d{3}[^\r]*)")


def encode_set_rate(code: int) -> bytes:
    """Encode the choice of a data rate: 0 to 4 for 125 to 2000 Hz, 5 for external trigger."""
    return f"m {code}\r".encode("ascii")


def encode_answer(echo: bytes, text: str) -> bytes:
    """Encode what the instrument answers to a command, the prompt included."""
    return echo + b"\r" + text.encode("ascii") + PROMPT


def error_of(answer: bytes) -> str | None:
    """Return the error that an answer reports, or ``None``."""
    found = _ERROR.search(answer)
    return None if found is None else found[1].decode("ascii", "replace")
