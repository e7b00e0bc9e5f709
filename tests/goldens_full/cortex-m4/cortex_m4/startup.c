/* Written by dzdesign 1.0.0 from template startup.c.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours. */

/* From reset to main(), in C: on ARMv7-M the processor loads the stack pointer itself (DDI 0403, B1.5.3). */
#include <stdint.h>

#include "dz_isr.h"

/* Symbols that the linker script defines; only their addresses have a meaning. */
extern uint32_t dz_stack_top;
extern const uint32_t dz_data_load;
extern uint32_t dz_data_start;
extern uint32_t dz_data_end;
extern uint32_t dz_bss_start;
extern uint32_t dz_bss_end;

int main(void);
void dz_fault(void);
void dz_reset(void);

struct dz_vectors
{
    uint32_t *stack_top;
    void (*handler[15])(void);
};

extern const struct dz_vectors dz_vectors;

__attribute__((section(".vectors"), used)) const struct dz_vectors dz_vectors = {
    &dz_stack_top,
    {
        dz_reset, /* 1 reset */
        dz_fault, /* 2 NMI */
        dz_fault, /* 3 hard fault */
        dz_fault, /* 4 memory management */
        dz_fault, /* 5 bus fault */
        dz_fault, /* 6 usage fault */
        dz_fault, /* 7 to 10 are reserved */
        dz_fault,
        dz_fault,
        dz_fault,
        dz_fault, /* 11 supervisor call */
        dz_fault, /* 12 debug monitor */
        dz_fault, /* 13 reserved */
        dz_fault, /* 14 pendable service call */
        dz_isr,   /* 15 SysTick */
    },
};

void dz_reset(void)
{
    const uint32_t *from = &dz_data_load;
    uint32_t *to;

    for (to = &dz_data_start; to != &dz_data_end; to++)
    {
        *to = *from;
        from++;
    }
    for (to = &dz_bss_start; to != &dz_bss_end; to++)
    {
        *to = 0u;
    }
    (void)main();
    dz_fault(); /* main() does not return */
}
