/* The core called at every pair of command and pressure difference, and nothing else: what any check has to take. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef DZ_BLOCK_FORM
#include "dz_comp.h"

#include "bound.h"
#else
uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
#endif

int main(int count, char **arguments)
{
    const int32_t last = count > 1 ? atoi(arguments[1]) : 0;
    uint32_t sum = 0;

    for (int32_t difference = -last; difference <= last; difference++) {
        const uint16_t p_b = (uint16_t)(difference < 0 ? -difference : 0), p_a = (uint16_t)(p_b + difference);

        for (int32_t u_adc = 0; u_adc <= last; u_adc++) {
            sum += dz_comp((uint16_t)u_adc, p_a, p_b);
        }
    }
    printf("%lu\n", (unsigned long)sum);
    return last > 0 ? 0 : 2;
}
