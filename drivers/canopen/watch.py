"""Whether a CANopen node lives, and whether there is only one of its number: told by its frames."""

from collections import deque

from drivers.codecs.canopen import NmtState
from drivers.errors import DriverError, LinkTimeoutError, ProtocolError, TransportError

HEARTBEAT_S = 0.1
LISTEN_S = HEARTBEAT_S / 2  # at a time; whatever takes longer held the listener up
_SILENCE_S = 5 * HEARTBEAT_S
_ROUNDING_S = 1e-9  # sums of spells are not exact
_WINDOW_S = 1.0
_TOO_MANY = 1.5 * _WINDOW_S / HEARTBEAT_S


class NodeWatch:
    """Draws its conclusions from what is heard of one node, in loop time; asks nothing itself.

    Args:
        name: The node in an error message: ``node 5 on socketcan can0``.
        node: Its number.
    """

    def __init__(self, name: str, node: int) -> None:
        self._name = name
        self._node = node
        self._others: set[int] = set()
        self._expecting = False
        self._missed_s = 0.0
        self._beat_s = 0.0
        self._frame_s = 0.0
        self._beats: deque[float] = deque()

    def expect_heartbeats(self, now_s: float) -> None:
        """Miss the heartbeat from now on: it was asked to come every ``HEARTBEAT_S``."""
        self._expecting, self._missed_s, self._beat_s = True, 0.0, now_s

    def note_listening(self, duration_s: float) -> None:
        """Note that the bus was listened to for so long, before what was heard meanwhile.

        A listener that was held up has not heard yet what came, and a node that stands on the
        same computer was held up too: only some of that time counts as listened to.
        """
        self._missed_s += min(duration_s, LISTEN_S)

    def note_frame(self, time_s: float) -> None:
        """Note that the node sent something."""
        self._frame_s = time_s

    def note_heartbeat(self, node: int, state: NmtState, time_s: float) -> DriverError | None:
        """Note a heartbeat of any node; return what it gives away."""
        if node != self._node:
            self._others.add(node)
            return None
        if not self._expecting:
            return None
        if state is NmtState.BOOT_UP:
            return TransportError(
                f"The {self._name} has restarted: it lost power for a moment, or a second device"
                " with this node number was switched on. Check its supply, then resume."
            )
        self._missed_s, self._beat_s = 0.0, time_s
        self._beats.append(time_s)
        while self._beats[0] < time_s - _WINDOW_S:
            self._beats.popleft()
        return self.doubled() if len(self._beats) > _TOO_MANY else None

    def doubled(self) -> DriverError:
        """Return what is to be said of two devices with one number."""
        return ProtocolError(
            f"Two devices answer as {self._name}, or another program asks it too. Give each device"
            " a node number of its own, and let one program at a time use it."
        )

    def unanswered(self, what: str, waited_s: float, attempts: int) -> DriverError:
        """Return what is to be said when a question was not answered, asked so many times."""
        others = ", ".join(map(str, sorted(self._others)))
        heard = f"nodes {others}" if others else "none"
        again = f", {attempts} times" if attempts > 1 else ""
        return LinkTimeoutError(
            f"The {self._name} did not answer within {waited_s:g} s (asked for {what}{again})."
            " Check its power, its node number and the bit rate."
            f" Others heard on this bus: {heard}."
        )

    def silence(self) -> DriverError | None:
        """Return what is to be said once the heartbeat has been missed for too long."""
        if not self._expecting or self._missed_s < _SILENCE_S - _ROUNDING_S:
            return None
        # A node that dies may have answered once more after its last heartbeat.
        if self._frame_s - self._beat_s > 0.5 * _SILENCE_S:
            why = "still answers, but sends no heartbeat any more: its firmware hangs. Restart it"
        else:
            why = f"has been silent for {_SILENCE_S:g} s. Check its power and its cable"
        return LinkTimeoutError(f"The {self._name} {why}, then resume.")
