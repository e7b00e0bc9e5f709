/* Written by dzdesign 1.0.0 from template dz_board.h.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours. */

/* What of your board the firmware must know: its clock. */
#ifndef DZ_BOARD_H
#define DZ_BOARD_H

#include <stdint.h>

/* 25000000 Hz / 2500 Hz = 10000 counts: SysTick runs from 9999 to 0. Change it with the clock. */
#define DZ_TICK_RELOAD UINT32_C(9999)

#endif
