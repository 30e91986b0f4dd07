"""CANopen nodes as their master sees them; what the instruments of several profiles share."""
