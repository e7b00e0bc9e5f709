/* Written by dzdesign 1.0.0 from template main.c.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours. */

#include "dz_board.h"
#include "dz_tick.h"

/* Every exception but SysTick ends here, from startup.c: the valve is de-energised, and your watchdog resets the chip. */
void dz_fault(void);

void dz_fault(void)
{
    for (;;)
    {
        dz_board_write_compare(0u, 0u);
    }
}

int main(void)
{
    uint32_t ticks_seen = 0u;

    dz_tick_start();
    for (;;)
    {
        if (dz_state.ticks != ticks_seen)
        {
            ticks_seen = dz_state.ticks;
            /* Service your watchdog here: it then monitors the interrupt, not this loop. */
        }
    }
}
