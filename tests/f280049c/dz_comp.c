/* In the place of the core: a compare value that tells which code came in at which place. */
#include "dz_comp.h"

uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return (u_adc == 0u) ? (uint16_t)0u : (uint16_t)(u_adc + (10u * p_a_adc) + (100u * p_b_adc));
}
