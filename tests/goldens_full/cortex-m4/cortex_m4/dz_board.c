/* Written by dzdesign 1.0.0 from template dz_board.c.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours. */

#include "dz_board.h"
#include "dz_drive.h"
#include "dz_hardware.h"

/* SysTick of the ARMv7-M architecture (DDI 0403, B3.3). */
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
#define SYST_CSR_ENABLE 0x1u
#define SYST_CSR_TICKINT 0x2u
#define SYST_CSR_CLKSOURCE 0x4u /* the processor's clock, not the external one */

/* No hardware yet: the codes come from a debugger, and the compare value goes where a debugger can see it. Put your
 * converter, your timer and its break input here. */
volatile uint16_t dz_board_u_adc = 2048u;
volatile uint16_t dz_board_p_a_adc = 0u;
volatile uint16_t dz_board_p_b_adc = 0u;
volatile uint16_t dz_board_compare_a = 0u;
volatile uint16_t dz_board_compare_b = 0u;
volatile uint16_t dz_board_tripped = 1u;

static uint16_t ticks_to_sample = 0u;

void dz_hardware_init(void)
{
    dz_trip_output();
}

/* The vector table in startup.c has dz_isr() for SysTick. Of another timer, such as the PWM's update: put dz_isr() where
 * that interrupt's vector is, or call it from your handler, and start the timer here in place of SysTick. */
void dz_interrupt_init(void)
{
    SYST_CSR = 0u;
    SYST_RVR = DZ_TICK_RELOAD;
    SYST_CVR = 0u; /* any write clears it */
    SYST_CSR = SYST_CSR_ENABLE | SYST_CSR_TICKINT | SYST_CSR_CLKSOURCE;
}

uint16_t dz_read_sample(uint16_t codes[DZ_SAMPLE_CODES])
{
    if (ticks_to_sample != 0u)
    {
        ticks_to_sample--;
        return 0u;
    }
    ticks_to_sample = DZ_DRIVE_TICKS_PER_SAMPLE - 1u;
    codes[0] = dz_board_u_adc;
    codes[1] = dz_board_p_a_adc;
    codes[2] = dz_board_p_b_adc;
    return 1u;
}

void dz_write_compare_a(uint16_t compare)
{
    dz_board_compare_a = compare;
}

void dz_write_compare_b(uint16_t compare)
{
    dz_board_compare_b = compare;
}

void dz_trip_output(void)
{
    dz_board_tripped = 1u;
}

void dz_untrip_output(void)
{
    dz_board_tripped = 0u;
}

uint16_t dz_output_tripped(void)
{
    return dz_board_tripped;
}

uint16_t dz_trip_inputs_high(void)
{
    return 1u;
}

void dz_interrupt_done(void)
{
    /* SysTick has no flag to clear. */
}
