"""Target avr: Atmel ATmega1280, the proxy for a 16-bit int; runs in simavr."""
