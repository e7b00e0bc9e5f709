/* Written by dzdesign 1.0.0 from template dz_tick.h.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours. */

/* The 2500 Hz interrupt: a sample becomes a compare value. */
#ifndef DZ_TICK_H
#define DZ_TICK_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* 25000000 Hz / 2500 Hz = 10000 counts: SysTick runs from 9999 to 0. Change it with the clock. */
#define DZ_TICK_RELOAD UINT32_C(9999)

/* Written by the interrupt only. */
struct dz_state
{
    uint32_t ticks; /* interrupts so far */
    uint16_t u_adc;
    uint16_t p_a_adc;
    uint16_t p_b_adc;
    uint16_t compare_a;
    uint16_t compare_b;
};

extern volatile struct dz_state dz_state;

/* Compare values 0, then SysTick from the processor's clock; the first interrupt comes one period later. */
void dz_tick_start(void);

/* SysTick's handler, in the vector table of startup.c. */
void dz_tick(void);

#ifdef __cplusplus
}
#endif

#endif
