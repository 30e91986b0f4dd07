"""Everything a driver raises on purpose.

DriverError
 +-- TransportError           the link failed: port absent, busy or gone
 |    +-- LinkTimeoutError    no answer in time; also a TimeoutError
 +-- ProtocolError            another device, or a reply its manual forbids
 |    +-- RefusedError        a CANopen node refuses access to an object; carries its abort code
 +-- DeviceFaultError         the device answered and reports a fault; carries its code

Line noise is none of these: codecs resynchronise and count it.
"""


class DriverError(Exception):
    """Base of every deliberate driver exception."""


class TransportError(DriverError):
    """The link itself failed."""


class LinkTimeoutError(TransportError, TimeoutError):
    """The device did not answer before its deadline."""


class ProtocolError(DriverError):
    """The device is not the expected one, or answered what its manual forbids."""


class RefusedError(ProtocolError):
    """A CANopen node refuses to read or write an object.

    Args:
        message: Which object, and why.
        code: The SDO abort code.
    """

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class DeviceFaultError(DriverError):
    """The device reports a fault of its own.

    Args:
        message: What happened, and what to do.
        code: The device's fault code, as its manual prints it.
    """

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message)
        self.code = code
