/* In the place of the core's: what the interrupt uses of the drive, and who drives is told from outside. */
#ifndef DZ_DRIVE_H
#define DZ_DRIVE_H
#include "dz_comp.h"
struct dz_drive
{
    uint16_t compare_a;
    uint16_t compare_b;
    uint16_t status;
    uint16_t law;
    int16_t side;
};
extern unsigned device_drive_samples, device_drive_ticks; /* calls since it was at rest */
void dz_drive_init(struct dz_drive *drive);
void dz_drive_sample(struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
void dz_drive_tick(struct dz_drive *drive);
#endif
