/* Ticks of SysTick for REPEATS calls: of a function that only returns, and of dz_comp; then what that gave.
 *
 * QEMU with `-icount shift=0` lets one instruction take 1 ns; SysTick runs at the board's 25 MHz, a tick is 40
 * instructions. The loop around the calls is the same machine code for both functions.
 */
#include "inputs.h"
#include "semihosting.h"

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
#define COUNTER UINT32_C(0xFFFFFF)

/* A core in block form has its block ahead of the codes, and either form may be asked for another function. */
#ifndef BLOCK
#define BLOCK
#define BLOCK_TYPE
#endif
#ifndef CALLED
#define CALLED dz_comp
#endif

typedef uint16_t (*isr_core)(BLOCK_TYPE uint16_t, uint16_t, uint16_t);
uint16_t CALLED(BLOCK_TYPE uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t only_return(BLOCK_TYPE uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
__asm(".thumb\n.global only_return\n.thumb_func\nonly_return: bx lr\n");

__attribute__((noinline)) static uint32_t ticks(isr_core core, const uint16_t *codes)
{
    const uint32_t start = SYST_CVR;

    for (int i = 0; i < REPEATS; i++) {
        (void)core(BLOCK codes[0], codes[1], codes[2]);
    }
    return (start - SYST_CVR) & COUNTER; /* it counts down */
}

int main(void)
{
    SYST_RVR = COUNTER;
    SYST_CVR = 0u;
    SYST_CSR = 5u; /* on, processor clock, no interrupt */
    for (int i = 0; i < INPUT_COUNT; i++) {
        put_number(ticks(only_return, inputs[i]));
        put_number(ticks(CALLED, inputs[i]));
        put_number(CALLED(BLOCK inputs[i][0], inputs[i][1], inputs[i][2]));
        put_text("\n");
    }
    return 0;
}
