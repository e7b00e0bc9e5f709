/* The drive on this machine beside its model, which says what it must hold after every tick. */
#include <string.h>

#include "dz_drive.h"

#ifdef DZ_CALIBRATION_WORDS
#include "bound.h"
#endif

/* Pressures, and channels of faults: the command, the pressures, with a third one those of each side. */
#ifdef DZ_STATUS_PRESSURE_C
#define PRESSURES 3
#define POINTERS(kind) &drive->kind##_pressures[0], &drive->kind##_pressures[1]
#define OF_PRESSURES(kind) drive->kind##_pressures[0], drive->kind##_pressures[1]
#else
#define PRESSURES 2
#define POINTERS(kind) &drive->kind##_pressures
#define OF_PRESSURES(kind) drive->kind##_pressures
#endif
#define FIELDS (10 + (2 * PRESSURES))
#define PUTS (2 + (2 * PRESSURES))

struct comparison {
    int32_t ticks, wrong, first, first_field; /* the first wrong one, and its field */
};

/* The state against the next one that is expected. */
static const int32_t *compare(const struct dz_drive *drive, const int32_t *expected, struct comparison *found)
{
    const int32_t state[FIELDS] = {drive->compare_a, drive->compare_b, drive->status, drive->law,
                                   drive->side,      drive->ticks,     drive->at_rest,
                                   drive->rising,    drive->played,    drive->ramped,
                                   drive->valid_commands,  OF_PRESSURES(valid),
                                   drive->faulty_commands, OF_PRESSURES(faulty)};
    int32_t field = 0;

    while (field < FIELDS && state[field] == expected[field]) {
        field++;
    }
    if (field < FIELDS && found->wrong++ == 0) {
        found->first = found->ticks;
        found->first_field = field;
    }
    return expected + FIELDS;
}

/* What a sample finds, where that is not INT32_MIN: the ramp's place, which samples would take minutes to bring; side,
 * rest and play; what is remembered of faults, sound and faulty samples of each channel. */
static void put(struct dz_drive *drive, const int32_t *puts)
{
    if (puts[0] != INT32_MIN) {
        drive->ramped = puts[0];
    }
    if (puts[1] != INT32_MIN) {
        drive->at_rest = (uint16_t)(puts[1] & 1);
        drive->side = (int16_t)(((puts[1] >> 1) & 3) - 1);
        drive->rising = (uint16_t)((puts[1] >> 3) & 63);
        drive->played = (int16_t)((puts[1] >> 9) - 8192);
    }
    if (puts[2] != INT32_MIN) {
        uint16_t *const valid[] = {&drive->valid_commands, POINTERS(valid)};
        uint16_t *const faulty[] = {&drive->faulty_commands, POINTERS(faulty)};

        for (int32_t channel = 0; channel < PRESSURES; channel++) {
            *valid[channel] = (uint16_t)puts[2 + (2 * channel)];
            *faulty[channel] = (uint16_t)puts[3 + (2 * channel)];
        }
    }
}

/* PWM periods before the first sample, then those of each sample: its codes, and the words that are put before it. */
void dz_check_drive(int32_t samples, int32_t ticks, const uint16_t *codes, const int32_t *puts, const int32_t *expected,
                    struct comparison *found)
{
    struct dz_drive drive;

    memset(&drive, 0xA5, sizeof drive);
    dz_drive_init(&drive);
    expected = compare(&drive, expected, found);
    for (int32_t sample = -1; sample < samples; sample++) {
        if (sample >= 0) {
            const uint16_t *code = &codes[(1 + PRESSURES) * sample];

            put(&drive, &puts[PUTS * sample]);
#ifdef DZ_STATUS_PRESSURE_C
            dz_drive_sample(&drive, code[0], code[1], code[2], code[3]);
#else
            dz_drive_sample(&drive, code[0], code[1], code[2]);
#endif
        }
        for (int32_t tick = 0; tick < ticks; tick++) {
            dz_drive_tick(&drive);
            found->ticks++;
            expected = compare(&drive, expected, found);
        }
    }
}
