"""Which device a CANopen node is (CiA 301, 7.5.2.1 and 7.5.2.18)."""

from drivers.canopen.node import CanopenNode
from drivers.codecs.canopen import NODES
from drivers.codecs.sdo import Entry
from drivers.errors import ProtocolError
from drivers.interfaces import CanSettings, Identity

_DEVICE_TYPE = Entry(0x1000)
_NAME, _SOFTWARE = Entry(0x1008), Entry(0x100A)
_VENDOR, _PRODUCT, _SERIAL = Entry(0x1018, 1), Entry(0x1018, 2), Entry(0x1018, 4)


def node_of(settings: CanSettings) -> int:
    """Return the node number that a configuration gives.

    Raises:
        ValueError: None, or none that CANopen knows.
    """
    if settings.node is None or settings.node not in NODES:
        msg = 'a node number from 1 to 127 must be given: link = "can:socketcan:can0:node=5"'
        raise ValueError(msg)
    return settings.node


async def require_profile(node: CanopenNode, profile: int, what: str) -> None:
    """Refuse a device of another kind.

    Raises:
        ProtocolError: Its device type names another profile.
        LinkTimeoutError: No answer.
    """
    device_type = await node.number(_DEVICE_TYPE)
    found = device_type & 0xFFFF
    if found != profile:
        msg = (
            f"The {node.name} is no {what}: its device type {device_type:08X}h says CiA {found},"
            f" not CiA {profile}. Check the node number."
        )
        raise ProtocolError(msg)


async def read_identity(node: CanopenNode) -> Identity:
    """Return vendor, name, serial number and software version, as far as the node tells them."""
    vendor = await node.number_if_present(_VENDOR)
    product = await node.number_if_present(_PRODUCT)
    serial_number = await node.number_if_present(_SERIAL)
    name = await node.text_if_present(_NAME) or f"product {product or 0:X}h"
    firmware = await node.text_if_present(_SOFTWARE)
    serial_text = "unknown" if serial_number is None else str(serial_number)
    return Identity(f"CANopen vendor {vendor or 0:X}h", name, serial_text, firmware)
