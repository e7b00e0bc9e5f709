/* How many instructions dz_calibration_check() takes on the Cortex-M4, in QEMU with `-icount shift=10`: an instruction
 * takes 25.6 ticks of SysTick at the board's 25 MHz. */
#include "dz_calibration.h"
#include "machine.h"

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

static const uint8_t octets[] __attribute__((aligned(8))) = {
#include "octets.h"
};

static void program(void)
{
    uint32_t from, to;
    uint16_t found;

    SYST_RVR = UINT32_C(0xFFFFFF);
    SYST_CVR = 0u;
    SYST_CSR = 5u; /* on, processor clock, no interrupt */
    from = SYST_CVR;
    found = dz_calibration_check((const struct dz_calibration *)(const void *)octets);
    to = SYST_CVR;
    put(found);
    put((((from - to) & UINT32_C(0xFFFFFF)) * 5u + 64u) / 128u);
}
