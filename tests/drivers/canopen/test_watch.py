"""What a node's frames give away, second by second."""

import pytest

from drivers.canopen.watch import HEARTBEAT_S, LISTEN_S, NodeWatch
from drivers.codecs.canopen import NmtState
from drivers.errors import LinkTimeoutError, ProtocolError, TransportError

ALIVE = NmtState.OPERATIONAL


@pytest.fixture
def watch() -> NodeWatch:
    """A watch that has missed heartbeats since the tenth second."""
    watch = NodeWatch("node 5 on sim:can", 5)
    watch.expect_heartbeats(10.0)
    return watch


def test_a_steady_heartbeat_gives_nothing_away(watch: NodeWatch) -> None:
    for tick in range(1, 1000):
        watch.note_listening(HEARTBEAT_S)
        assert watch.silence() is None
        assert watch.note_heartbeat(5, ALIVE, 10.0 + HEARTBEAT_S * tick) is None


def listen(watch: NodeWatch, duration_s: float) -> None:
    """Listen as a node does."""
    for _ in range(round(duration_s / LISTEN_S)):
        watch.note_listening(LISTEN_S)


@pytest.mark.parametrize(("frame_s", "words"), [(10.4, "firmware hangs"), (10.0, "silent for 0.5")])
def test_half_a_second_without_a_heartbeat_is_silence(
    watch: NodeWatch, frame_s: float, words: str
) -> None:
    watch.note_frame(frame_s)
    listen(watch, 0.45)
    assert watch.silence() is None
    listen(watch, 0.05)
    error = watch.silence()
    assert isinstance(error, LinkTimeoutError)
    assert words in str(error)


def test_a_listener_that_was_held_up_takes_no_node_for_silent(watch: NodeWatch) -> None:
    """What came meanwhile is not read yet, and others' frames may come before the heartbeat."""
    watch.note_listening(3.0)
    watch.note_frame(13.0)
    listen(watch, 0.4)
    assert watch.silence() is None
    listen(watch, 0.05)
    assert watch.silence() is not None


def test_a_boot_up_is_a_restart_only_once_heartbeats_are_expected(watch: NodeWatch) -> None:
    error = watch.note_heartbeat(5, NmtState.BOOT_UP, 10.1)
    assert isinstance(error, TransportError)
    assert "has restarted" in str(error)
    fresh = NodeWatch("node 5 on sim:can", 5)
    assert fresh.note_heartbeat(5, NmtState.BOOT_UP, 10.1) is None
    listen(fresh, 100.0)
    assert fresh.silence() is None


def test_twice_as_many_heartbeats_are_two_nodes_within_two_seconds(watch: NodeWatch) -> None:
    found = [watch.note_heartbeat(5, ALIVE, 10.0 + HEARTBEAT_S * half / 2) for half in range(1, 41)]
    first = next(error for error in found if error is not None)
    assert isinstance(first, ProtocolError)
    assert "Two devices answer as node 5 on sim:can" in str(first)


def test_a_heartbeat_ten_percent_fast_is_one_node(watch: NodeWatch) -> None:
    for tick in range(1, 200):
        assert watch.note_heartbeat(5, ALIVE, 10.0 + 0.9 * HEARTBEAT_S * tick) is None


def test_others_are_named_in_order_and_are_no_sign_of_life(watch: NodeWatch) -> None:
    for other in (9, 7, 9):
        assert watch.note_heartbeat(other, NmtState.BOOT_UP, 10.4) is None
    listen(watch, 0.5)
    assert watch.silence() is not None
    error = watch.unanswered("1000h:0", 0.5, 2)
    assert "(asked for 1000h:0, 2 times)" in str(error)
    assert "Others heard on this bus: nodes 7, 9." in str(error)
