"""Target f280049c: TI TMS320F280049C, 100 MHz, ePWM1 at 2.5 kHz, EABI, DriverLib of C2000Ware."""
