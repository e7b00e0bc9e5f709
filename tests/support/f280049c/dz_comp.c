/* In the place of the core: a compare value that tells which code came in at which place. */
#include "dz_drive.h"
#include "model.h"

uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return (u_adc == 0u) ? (uint16_t)0u : (uint16_t)(u_adc + (10u * p_a_adc) + (100u * p_b_adc));
}

void dz_drive_init(struct dz_drive *drive)
{
    const struct dz_drive at_rest = {0u, 0u, 0u, 0, 0u, 0u, 0u};
    *drive = at_rest;
}

void dz_drive_sample(struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    drive->law = dz_comp(u_adc, p_a_adc, p_b_adc);
    drive->side = (int16_t)device_side;
    drive->samples++;
}

void dz_drive_tick(struct dz_drive *drive)
{
    drive->compare_a = (drive->side > 0) ? drive->law : (uint16_t)0u;
    drive->compare_b = (drive->side < 0) ? drive->law : (uint16_t)0u;
    drive->ticks++;
}
