/* The part of the F28335 around the registers: EALLOW, write-1 bits, ADC sequencer, PWM pin, interrupt path. */
#ifndef DEVICE_H
#define DEVICE_H

#include <stdint.h>

struct tick
{
    const char *output; /* during the period: "low", "high" or "pwm" */
    unsigned duty;      /* counts high in the period */
    unsigned served;    /* 1 if the interrupt was taken */
    unsigned reset_busy; /* 1 if RST_SEQ1 was written during a running sequence */
    unsigned resets;    /* RST_SEQ1 writes */
    unsigned acknowledged; /* PIEACK as written */
};

extern void (*device_on_eint)(void);
extern void (*device_on_service)(void);

void device_power_up(void);
void device_settle(void);
struct tick device_period(char event);

#endif
