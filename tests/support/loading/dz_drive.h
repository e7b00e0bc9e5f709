/* In the place of the core's drive in block form: what the interrupt uses of it. */
#ifndef DZ_DRIVE_H
#define DZ_DRIVE_H
#include "dz_comp.h"
#define DZ_STATUS_CALIBRATION 256u
struct dz_drive
{
    uint16_t compare_a;
    uint16_t compare_b;
    uint16_t status;
    uint16_t law;
    int16_t side;
    int32_t ramped;
};
void dz_drive_init(const struct dz_calibration *block, struct dz_drive *drive);
void dz_drive_sample(const struct dz_calibration *block, struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc,
                     uint16_t p_b_adc);
void dz_drive_tick(const struct dz_calibration *block, struct dz_drive *drive);
#endif
