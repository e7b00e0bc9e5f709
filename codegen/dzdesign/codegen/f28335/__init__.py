"""Target f28335: TI TMS320F28335, 150 MHz, ePWM1 at 2.5 kHz, COFF, bit-field headers of C2000Ware."""
