/* In the place of the core; see its headers. */
#include "dz_drive.h"
#include "periods.h"

unsigned device_drive_samples, device_drive_ticks;

uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return (uint16_t)(u_adc + 10u * p_a_adc + 100u * p_b_adc);
}

uint16_t dz_status(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return (uint16_t)((u_adc != 0u ? 1u : 0u) + (p_a_adc != 1u ? 2u : 0u) + (p_b_adc == 2u ? 4u : 0u));
}

uint16_t dz_beta(uint16_t p_a_adc, uint16_t p_b_adc) { return (uint16_t)(3u * p_a_adc + 7u * p_b_adc); }

uint16_t dz_beta_negative(uint16_t p_a_adc, uint16_t p_b_adc) { return (uint16_t)(5u * p_a_adc + 9u * p_b_adc); }

uint16_t dz_status_negative(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return (uint16_t)(dz_status(u_adc, p_a_adc, p_b_adc) ^ 8u);
}

void dz_drive_init(struct dz_drive *drive)
{
    const struct dz_drive at_rest = {0u, 0u, 0u, 0u, 0};
    *drive = at_rest;
    device_drive_samples = device_drive_ticks = 0u;
}

void dz_drive_sample(struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    drive->law = dz_comp(u_adc, p_a_adc, p_b_adc);
    drive->side = (int16_t)device_side;
    device_drive_samples++;
}

void dz_drive_tick(struct dz_drive *drive)
{
    drive->compare_a = (uint16_t)((drive->side > 0) ? drive->law : 0u);
    drive->compare_b = (uint16_t)((drive->side < 0) ? drive->law : 0u);
    device_drive_ticks++;
}
