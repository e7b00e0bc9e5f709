/* The compiled core, and of a drive by current its controller, as functions that Python calls sample by sample. */
#include <stddef.h>

#include "dz_drive.h"

#ifdef WITH_CURRENT
#include "dz_current.h"
#include "tick.h"
#endif

#ifdef DZ_CALIBRATION_WORDS
#include "bound.h"
#endif

uint32_t core_bytes(void)
{
    return (uint32_t)sizeof(struct dz_drive);
}

uint32_t core_periods_per_sample(void)
{
    return DZ_DRIVE_TICKS_PER_SAMPLE;
}

void core_init(struct dz_drive *drive)
{
    dz_drive_init(drive);
}

/* Of each of the samples new codes of command and sensors A and B, then the ticks up to the next one. shown[4] of each
 * tick: compare values of solenoids A and B, that of the law, side. */
void core_samples(struct dz_drive *drive, const uint16_t *codes, uint32_t count, int32_t *shown)
{
    for (uint32_t k = 0u; k < count; k++, codes += 3) {
        dz_drive_sample(drive, codes[0], codes[1], codes[2]);
        for (uint32_t tick = 0u; tick < DZ_DRIVE_TICKS_PER_SAMPLE; tick++, shown += 4) {
            dz_drive_tick(drive);
            shown[0] = (int32_t)drive->compare_a;
            shown[1] = (int32_t)drive->compare_b;
            shown[2] = (int32_t)drive->law;
            shown[3] = (int32_t)drive->side;
        }
    }
}

#ifdef WITH_CURRENT
uint32_t controller_bytes(void)
{
    return (uint32_t)sizeof(struct dz_current);
}

/* Calibrated with the sum that the converter gives of no current. */
void controller_init(struct dz_current *loop, uint16_t sum_of_no_current)
{
    dz_current_init(loop);
    for (uint16_t tick = 0u; tick < DZ_CURRENT_OFFSET_TICKS; tick++) {
        dz_current_calibrate(loop, sum_of_no_current);
    }
}

/* Returns the compare value of the next period. */
uint32_t controller_tick(struct dz_current *loop, uint16_t set_point, uint16_t sum, uint16_t supply)
{
    TICK(loop, set_point, sum, supply);
    return (uint32_t)loop->compare;
}
#endif
