"""Target avr: Atmel ATmega1280, the proxy for a 16-bit int; runs in simavr."""

if __name__ != "dzdesign.codegen.avr":
    raise ImportError("import this room as dzdesign.codegen.avr")
