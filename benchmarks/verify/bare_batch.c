/* What the check calls at every pair of command and pressure difference, the drive and the law, and nothing else. */
#include <stdio.h>
#include <stdlib.h>

#include "dz_drive.h"

int main(int count, char **arguments)
{
    const int32_t last = count > 1 ? atoi(arguments[1]) : 0;
    struct dz_drive drive;
    uint32_t sum = 0;

    dz_drive_init(&drive);
    for (int32_t difference = -last; difference <= last; difference++) {
        const uint16_t p_b = (uint16_t)(difference < 0 ? -difference : 0), p_a = (uint16_t)(p_b + difference);

        for (int32_t u_adc = 0; u_adc <= last; u_adc++) {
            dz_drive_sample(&drive, (uint16_t)u_adc, p_a, p_b);
            dz_drive_tick(&drive);
            sum += drive.compare_a + dz_comp((uint16_t)u_adc, p_a, p_b);
        }
    }
    printf("%lu\n", (unsigned long)sum);
    return last > 0 ? 0 : 2;
}
