/* One call an input, for callgrind, which counts each by itself; what dz_comp gave on stdout. */
#include <stdio.h>

#include "inputs.h"

uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);

int main(void)
{
    for (int i = 0; i < INPUT_COUNT; i++) {
        printf("%u\n", (unsigned)dz_comp(inputs[i][0], inputs[i][1], inputs[i][2]));
    }
    return 0;
}
