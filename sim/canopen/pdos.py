"""Process data objects of a simulated node and their parameters (CiA 301, 7.5.2.35 to .38)."""

from collections.abc import Callable, Container

from drivers.codecs.pdo import BY_EVENT, INVALID, MOST_BITS, Mapped, decode_pdo, encode_pdo
from drivers.codecs.sdo import Abort, Entry
from drivers.codecs.sdo_server import AccessError
from drivers.interfaces import CanFrame
from sim.canopen.dictionary import ObjectDictionary
from sim.canopen.timers import Timers

PDOS = range(4)
_RPDO, _RPDO_MAP, _TPDO, _TPDO_MAP = 0x1400, 0x1600, 0x1800, 0x1A00
_COB_ID, _TYPE, _EVENT_TIMER = 1, 2, 5

_EXTENDED = 1 << 29
_IDENTIFIER_BITS = 0x3FFF_FFFF  # may not be changed while the PDO is valid
_MOST_OBJECTS = 8
_SYNCHRONOUS = range(1, 241)
_TPDO_TYPES = {*_SYNCHRONOUS, 254, BY_EVENT}
_RPDO_TYPES = {0, *_TPDO_TYPES}
#: Identifiers that no PDO may have (7.3.5, table 40).
_RESTRICTED = (
    range(0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x700),
    range(0x701, 0x800),
)


class Parameters:
    """One PDO's parameters in the object dictionary, changed only as CiA 301 lets them be.

    Args:
        objects: The object dictionary.
        communication: Index of its communication parameters.
        mapping: Index of its mapping.
        types: Transmission types that it knows.
        changed: Called after each change.
    """

    def __init__(
        self,
        objects: ObjectDictionary,
        communication: int,
        mapping: int,
        types: Container[int],
        changed: Callable[[], None],
    ) -> None:
        self._objects = objects
        self._communication, self._mapping = communication, mapping
        self._types = types
        self._changed = changed
        for sub_index, check in ((_COB_ID, self._check_cob_id), (_TYPE, self._check_type)):
            objects.on_write(Entry(communication, sub_index), self._acting(check))
        if Entry(communication, _EVENT_TIMER) in objects:
            objects.on_write(Entry(communication, _EVENT_TIMER), self._acting(lambda _: None))
        objects.on_write(Entry(mapping, 0), self._acting(self._check_count))
        for sub_index in range(1, _MOST_OBJECTS + 1):
            objects.on_write(Entry(mapping, sub_index), self._acting(self._check_mapped))
        self.load()

    def load(self) -> None:
        """Take over what stands in the object dictionary."""
        number = self._objects.number
        cob_id = number(Entry(self._communication, _COB_ID))
        self.valid, self.can_id = not cob_id & INVALID, cob_id & 0x7FF
        self._identifier = cob_id & _IDENTIFIER_BITS
        self.type = number(Entry(self._communication, _TYPE))
        timer = Entry(self._communication, _EVENT_TIMER)
        self.event_timer_s = number(timer) / 1000 if timer in self._objects else 0.0
        self.mapping = self._mapped(number(Entry(self._mapping, 0)))

    def _mapped(self, count: int) -> list[Mapped]:
        entries = (Entry(self._mapping, sub_index) for sub_index in range(1, count + 1))
        return [Mapped.from_number(self._objects.number(entry)) for entry in entries]

    def _acting(self, check: Callable[[int], None]) -> Callable[[int], None]:
        def act(number: int) -> None:
            check(number)
            self.load()
            self._changed()

        return act

    def _check_cob_id(self, cob_id: int) -> None:
        can_id = cob_id & 0x7FF
        if cob_id & _EXTENDED or any(can_id in restricted for restricted in _RESTRICTED):
            raise AccessError(Abort.VALUE)
        if self.valid and cob_id & _IDENTIFIER_BITS != self._identifier:
            raise AccessError(Abort.VALUE)

    def _check_type(self, number: int) -> None:
        if number not in self._types:
            raise AccessError(Abort.VALUE)

    def _check_count(self, count: int) -> None:
        if self.valid:
            raise AccessError(Abort.UNSUPPORTED_ACCESS)
        if count > _MOST_OBJECTS:
            raise AccessError(Abort.VALUE)
        mapping = self._mapped(count)
        for mapped in mapping:
            self._require_mappable(mapped)
        if sum(mapped.bits for mapped in mapping) > MOST_BITS:
            raise AccessError(Abort.PDO_LENGTH)

    def _check_mapped(self, number: int) -> None:
        if self.valid or self.mapping:
            raise AccessError(Abort.UNSUPPORTED_ACCESS)
        if number:  # 0 is an unused place
            self._require_mappable(Mapped.from_number(number))

    def _require_mappable(self, mapped: Mapped) -> None:
        variable = self._objects.variable(mapped.entry)
        received = self._mapping < _TPDO
        allowed = variable.writable if received else variable.readable
        if not (variable.mappable and allowed and mapped.bits == 8 * variable.size):
            raise AccessError(Abort.NOT_MAPPABLE)


class _Transmitted:
    """One TPDO, and what of it has been sent."""

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.syncs = 0
        self.sent: bytes | None = None


class ProcessData:
    """All PDOs that a node's data sheet has, up to four each way; idle until started.

    Args:
        objects: The object dictionary.
        timers: For the event timers.
        send: Puts a frame on the bus.
        report: Told when a PDO came too short to be used.
    """

    def __init__(
        self,
        objects: ObjectDictionary,
        timers: Timers,
        send: Callable[[CanFrame], None],
        report: Callable[[], None],
    ) -> None:
        self._objects, self._timers = objects, timers
        self._send, self._report = send, report
        self._running = False
        self._waiting: dict[int, bytes] = {}
        self._received = [
            Parameters(objects, _RPDO + n, _RPDO_MAP + n, _RPDO_TYPES, lambda: None)
            for n in PDOS
            if Entry(_RPDO + n, _COB_ID) in objects
        ]
        self._transmitted = [
            _Transmitted(Parameters(objects, _TPDO + n, _TPDO_MAP + n, _TPDO_TYPES, self._rearm))
            for n in PDOS
            if Entry(_TPDO + n, _COB_ID) in objects
        ]

    def start(self) -> None:
        """Begin: the node is OPERATIONAL. What goes by event is sent once."""
        self._running = True
        for pdo in self._transmitted:
            pdo.syncs, pdo.sent = 0, None
        self._rearm()
        self.note_change()

    def stop(self) -> None:
        """Send and take nothing any more."""
        self._running = False
        self._waiting.clear()
        self._rearm()

    def load(self) -> None:
        """Take over the object dictionary, which has been reset."""
        for parameters in self._received:
            parameters.load()
        for pdo in self._transmitted:
            pdo.parameters.load()
        self._rearm()

    def note_change(self) -> None:
        """Send what goes by event, where it differs from what was sent."""
        if not self._running:
            return
        for pdo in self._transmitted:
            if pdo.parameters.valid and pdo.parameters.type not in _SYNCHRONOUS:
                data = self._encode(pdo)
                if data != pdo.sent:
                    self._transmit(pdo, data)
                    self._rearm_one(pdo)

    def note_sync(self) -> None:
        """Send what is due after this SYNC, and act on what was waiting for it."""
        if not self._running:
            return
        for parameters in self._received:
            data = self._waiting.pop(parameters.can_id, None)
            if data is not None:
                self._take(parameters, data)
        for pdo in self._transmitted:
            if pdo.parameters.valid and pdo.parameters.type in _SYNCHRONOUS:
                pdo.syncs += 1
                if pdo.syncs >= pdo.parameters.type:
                    pdo.syncs = 0
                    self._transmit(pdo, self._encode(pdo))

    def receive(self, frame: CanFrame) -> None:
        """Take a frame that may be an RPDO."""
        if not self._running or frame.extended or frame.remote:
            return
        for parameters in self._received:
            if parameters.valid and parameters.can_id == frame.can_id:
                if parameters.type >= 254:
                    self._take(parameters, frame.data)
                else:
                    self._waiting[parameters.can_id] = frame.data

    def _take(self, parameters: Parameters, data: bytes) -> None:
        values = decode_pdo(parameters.mapping, data)
        if values is None:
            self._report()
        else:
            self._objects.take(values)

    def _encode(self, pdo: _Transmitted) -> bytes:
        mapping, number = pdo.parameters.mapping, self._objects.number
        return encode_pdo(mapping, {entry: number(entry) for entry, _ in mapping})

    def _transmit(self, pdo: _Transmitted, data: bytes) -> None:
        pdo.sent = data
        self._send(CanFrame(pdo.parameters.can_id, data))

    def _rearm(self) -> None:
        for pdo in self._transmitted:
            self._rearm_one(pdo)

    def _rearm_one(self, pdo: _Transmitted) -> None:
        parameters = pdo.parameters
        by_event = parameters.valid and parameters.type not in _SYNCHRONOUS
        period_s = parameters.event_timer_s if self._running and by_event else 0.0
        self._timers.set(pdo, lambda: self._transmit(pdo, self._encode(pdo)), period_s)
