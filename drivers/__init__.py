"""Bytes and instruments: gyros, accelerometers and turntables. Nothing here knows of north."""
