"""The device side of the wire: instruments that answer bytes, on a bench that feels like Earth."""
