/* What Frama-C's Eva is asked: entry points that give the core every input, in pieces whose intervals tell enough.
 * pieces.h, written beside this file, names the functions of one side and where its pieces end.
 *
 * Eva knows an interval a variable, and not that two variables hang together. So `commands` splits the command where
 * something begins or ends, and `pressures` the pressures at the places where their difference changes sign or becomes
 * that of a failed sensor: code by code of sensor B. What is shown of a place in the C by one of them is shown. */
#include <stdint.h>

#include "__fc_builtin.h"
#include "dz_drive.h"

#ifdef DZ_CALIBRATION_H
#include "bound.h"
#endif
#include "pieces.h"

static uint16_t from_to(uint32_t first, uint32_t end)
{
    return (uint16_t)Frama_C_unsigned_long_interval(first, end - 1u);
}

static uint16_t anything(void)
{
    return from_to(0u, UINT32_C(65536));
}

static void core(uint16_t u, uint16_t a, uint16_t b)
{
    const uint16_t compare = COMP(u, a, b);
    const uint16_t beta = BETA(a, b);
    const uint16_t status = STATUS(u, a, b);

    /*@ assert status: status <= 31; */
    (void)compare;
    (void)beta;
    (void)status;
}

/* Any code, in its pieces one at a time. */
static uint16_t command(void)
{
    static const uint32_t ends[] = COMMAND_ENDS;
    const int piece = Frama_C_interval(0, (int)(sizeof ends / sizeof ends[0]) - 2);

    /*@ split piece; */
    return from_to(ends[piece], ends[piece + 1]);
}

void commands(void)
{
    core(command(), anything(), anything());
}

static const uint32_t pressure_ends[][5] = PRESSURE_ENDS;

/* With sensor B at a code of PART, sensor A in its pieces. */
void pressures(void)
{
    /*@ loop unroll 65536; */
    for (uint32_t row = PART_FIRST; row < PART_END; row++) {
        const uint16_t b = (uint16_t)(SOUND_B + row);

        /*@ loop unroll 4; */
        for (int piece = 0; piece < 4; piece++) {
            if (pressure_ends[row][piece] < pressure_ends[row][piece + 1]) {
                core(anything(), from_to(pressure_ends[row][piece], pressure_ends[row][piece + 1]), b);
            }
        }
    }
}

/* With codes that one of the sensors can't give. */
void no_pressures(void)
{
    static const uint32_t a_ends[][2] = NOT_OF_A;
    static const uint32_t b_ends[][2] = NOT_OF_B;

    /*@ loop unroll 4; */
    for (uint16_t piece = 0; piece < sizeof a_ends / sizeof a_ends[0]; piece++) {
        core(anything(), from_to(a_ends[piece][0], a_ends[piece][1]), anything());
    }
    /*@ loop unroll 4; */
    for (uint16_t piece = 0; piece < sizeof b_ends / sizeof b_ends[0]; piece++) {
        core(anything(), anything(), from_to(b_ends[piece][0], b_ends[piece][1]));
    }
}

/* One sample and one tick of the drive, from any state whose command is one between full and full. */
void drive(void)
{
    struct dz_drive drive;

    dz_drive_init(&drive);
    drive.compare_a = anything();
    drive.compare_b = anything();
    drive.status = anything();
    drive.law = anything();
    drive.side = (int16_t)Frama_C_interval(-1, 1);
    drive.ticks = anything();
    drive.at_rest = (uint16_t)Frama_C_interval(0, 1);
    drive.rising = (uint16_t)Frama_C_interval(0, TRAVEL);
    drive.played = (int16_t)Frama_C_interval(-(FURTHEST), FURTHEST);
    drive.ramped = Frama_C_long_interval(-(RAMPED), RAMPED);
    if (Frama_C_interval(0, 1)) {
        dz_drive_sample(&drive, command(), anything(), anything());
    } else {
        dz_drive_tick(&drive);
    }
}
