/* Written by dzdesign 1.0.0 from template main.c.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours. */

#include "dz_hardware.h"
#include "dz_isr.h"

/* Every exception but SysTick ends here, from startup.c: the valve is de-energised, and your watchdog resets the chip. */
void dz_fault(void);

void dz_fault(void)
{
    for (;;)
    {
        dz_trip_output();
    }
}

int main(void)
{
    uint16_t ticks_seen = 0u;

    dz_hardware_init();
    dz_isr_init(0u); /* or a bit of yours, such as after a reset by the watchdog: then the output stays tripped */
    dz_interrupt_init();
    for (;;)
    {
        if (dz_state.ticks != ticks_seen)
        {
            ticks_seen = dz_state.ticks;
            /* Service your watchdog here: it then monitors the interrupt, not this loop. */
        }
    }
}
