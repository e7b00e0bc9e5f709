/* The compiled core, and of a drive by current its controller, as functions that Python calls one by one. */
#include <stddef.h>

#include "dz_drive.h"

#ifdef WITH_CURRENT
#include "dz_current.h"
#include "tick.h"
#endif

#ifdef DZ_CALIBRATION_H
#include "bound.h"
#endif

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT
#endif

EXPORT uint32_t core_bytes(void)
{
    return (uint32_t)sizeof(struct dz_drive);
}

EXPORT uint32_t core_periods_per_sample(void)
{
    return DZ_DRIVE_TICKS_PER_SAMPLE;
}

EXPORT void core_init(struct dz_drive *drive)
{
    dz_drive_init(drive);
}

EXPORT void core_sample(struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    dz_drive_sample(drive, u_adc, p_a_adc, p_b_adc);
}

/* shown[4]: compare values of solenoids A and B, that of the law, side. */
EXPORT void core_tick(struct dz_drive *drive, int32_t *shown)
{
    dz_drive_tick(drive);
    shown[0] = (int32_t)drive->compare_a;
    shown[1] = (int32_t)drive->compare_b;
    shown[2] = (int32_t)drive->law;
    shown[3] = (int32_t)drive->side;
}

#ifdef WITH_CURRENT
EXPORT uint32_t controller_bytes(void)
{
    return (uint32_t)sizeof(struct dz_current);
}

/* Calibrated with the sum that the converter gives of no current. */
EXPORT void controller_init(struct dz_current *loop, uint16_t sum_of_no_current)
{
    dz_current_init(loop);
    for (uint16_t tick = 0u; tick < DZ_CURRENT_OFFSET_TICKS; tick++) {
        dz_current_calibrate(loop, sum_of_no_current);
    }
}

/* Returns the compare value of the next period. */
EXPORT uint32_t controller_tick(struct dz_current *loop, uint16_t set_point, uint16_t sum, uint16_t supply)
{
    TICK(loop, set_point, sum, supply);
    return (uint32_t)loop->compare;
}
#endif
