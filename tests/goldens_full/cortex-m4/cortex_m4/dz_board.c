/* Written by dzdesign 1.0.0 from template dz_board.c.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours. */

#include "dz_board.h"

/* No hardware yet: the codes come from a debugger, and the compare value goes where a debugger can see it. Put your
 * converter and your timer here. */
volatile uint16_t dz_board_u_adc = DZ_NO_CODE;
volatile uint16_t dz_board_p_a_adc = DZ_NO_CODE;
volatile uint16_t dz_board_p_b_adc = DZ_NO_CODE;
volatile uint16_t dz_board_compare_a = 0u;
volatile uint16_t dz_board_compare_b = 0u;

uint16_t dz_board_read_command(void)
{
    return dz_board_u_adc;
}

uint16_t dz_board_read_pressure_a(void)
{
    return dz_board_p_a_adc;
}

uint16_t dz_board_read_pressure_b(void)
{
    return dz_board_p_b_adc;
}

void dz_board_write_compare(uint16_t compare_a, uint16_t compare_b)
{
    dz_board_compare_a = compare_a;
    dz_board_compare_b = compare_b;
}
