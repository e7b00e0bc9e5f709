"""Target f28335: TI TMS320F28335, 150 MHz, ePWM1 at 2.5 kHz, COFF, bit-field headers of C2000Ware."""

if __name__ != "dzdesign.codegen.f28335":
    raise ImportError("import this room as dzdesign.codegen.f28335")
