"""Sans-IO codecs: bytes in, events out, and back. No port, no clock, no event loop."""
