"""The instruments of the other end of the wire: bytes in, bytes out."""
