"""Loading a calibration block over a serial line: the protocol, stated once, its C, and the PC's side of it."""
