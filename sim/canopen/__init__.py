"""The device side of CANopen: object dictionary, process data, network management."""
