"""Tests on a real SocketCAN bus: collected only under `tests/vcan/run`, which provides one."""

import os

collect_ignore_glob = [] if os.environ.get("VCAN_TESTS") else ["test_*.py"]
