/* Stands in for the firmware where the valve is driven directly. */
#ifndef DZ_DRIVE_H
#define DZ_DRIVE_H

#include <stdint.h>

#define DZ_DRIVE_TICKS_PER_SAMPLE 2u /* no code is read, so any number */

struct dz_drive
{
    uint16_t compare_a;
    uint16_t compare_b;
    uint16_t law;
    int16_t side;
};

static void dz_drive_init(struct dz_drive *drive)
{
    drive->compare_a = 0u;
    drive->compare_b = 0u;
    drive->law = 0u;
    drive->side = 0;
}

static void dz_drive_sample(struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    (void)drive;
    (void)u_adc;
    (void)p_a_adc;
    (void)p_b_adc;
}

static void dz_drive_tick(struct dz_drive *drive)
{
    (void)drive;
}

#endif
