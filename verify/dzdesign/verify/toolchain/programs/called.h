/* What runs at an input: the drive as the firmware's interrupt calls it, and dz_comp(), which others may call. */
#ifndef CALLED_H
#define CALLED_H

#include "every_input.h"

#include "dz_comp.h"
#ifdef DZ_SIDE
#include "dz_drive.h"
#else
struct dz_drive { /* an output with the law alone, which nobody drives with */
    uint16_t none;
};
#endif

#ifdef DZ_CALIBRATION_WORDS
#include "bound.h"
#endif

/* Bits of the status: what the tests do not reach, and a drive without a sound command. */
#define ABOVE_TESTS 16
#define NO_COMMAND (1u | 32u)

struct called {
    uint16_t law;
    uint16_t unlike; /* not 0: outputs or status do not follow from it, or dz_comp() differs */
};

/* A drive that has run in on this side: the interlock is passed, no fault is remembered, the command rises. */
static inline struct dz_drive run_in(void)
{
    struct dz_drive drive = {0};

#ifdef DZ_SIDE
    dz_drive_init(&drive);
    drive.side = DZ_SIDE;
    drive.at_rest = 0u;
#ifdef DZ_STATUS_PRESSURE_C
    drive.valid_commands = drive.valid_pressures[0];
#else
    drive.valid_commands = drive.valid_pressures;
#endif
#endif
    return drive;
}

/* The status of a sound command at a difference of sound pressure codes. */
static inline uint16_t status_at(const struct dz_plan *plan, int32_t difference)
{
    const int32_t failed = difference < -plan->reverse ? plan->failed_status : 0;

    return (uint16_t)(failed | (difference > plan->tested_to ? ABOVE_TESTS : 0));
}

#ifdef DZ_SIDE
/* What a law becomes in a tick: a square wave about it, unless it is 0. */
static inline uint16_t with_dither(const struct dz_plan *plan, uint16_t law, uint16_t up)
{
    const int32_t compare = law + (up != 0u ? plan->dither_counts : -plan->dither_counts);

    return (uint16_t)(law == 0u ? 0 : compare < 0 ? 0 : compare > plan->compare_limit ? plan->compare_limit : compare);
}
#endif

/* One input, of the pressures those ahead and behind; a third one is any code, and changes no output. What the law follows is put where the command is: ramps have run out, the play stands at it. The drive's
 * status is `status` where `care` has bits; without a sound command it waits. A command that turns a drive of two sides
 * to the other one is tried from that one. */
static inline struct called call(const struct dz_plan *plan, const struct dz_drive *ready, uint16_t u_adc,
                                 uint16_t ahead, uint16_t behind, uint16_t status, uint16_t care)
{
    struct called found = {DZ_CORE(u_adc, ahead, behind), 0u};
#ifdef DZ_SIDE
    const int32_t towards = plan->code_step * ((int32_t)u_adc - plan->zero_code);
    const int32_t place = plan->code_step * ((int32_t)u_adc - plan->first_code);
    const uint16_t up = u_adc & 1u;
    struct dz_drive drive = *ready;
    uint16_t codes[3] = {0u, 0u, 0u};

    if (plan->both != 0 && towards < -plan->leave_zero) {
        return found;
    }
    if (place < plan->sound_from || place >= plan->sound_to) {
        status = NO_COMMAND;
        care &= NO_COMMAND;
    }
    drive.played = (int16_t)towards;
    drive.ramped = (int32_t)((uint32_t)(plan->both != 0 || towards > 0 ? DZ_SIDE * towards : 0) * (uint32_t)plan->ramp_unit);
    drive.ticks = (uint16_t)((up != 0u ? 2 * plan->dither_ticks : plan->dither_ticks) - 1);
#ifdef DZ_STATUS_PRESSURE_C
    codes[plan->other_input] = (uint16_t)((u_adc * 40503u) + (behind * 257u));
    care &= (uint16_t)~plan->other_bit;
#endif
    codes[plan->ahead_input] = ahead;
    codes[plan->behind_input] = behind;
#ifdef DZ_STATUS_PRESSURE_C
    dz_drive_sample(&drive, u_adc, codes[0], codes[1], codes[2]);
#else
    dz_drive_sample(&drive, u_adc, codes[0], codes[1]);
#endif
    dz_drive_tick(&drive);
    found.unlike = (uint16_t)((found.law ^ drive.law) | ((drive.status ^ status) & care));
    found.law = drive.law;
    found.unlike |= (uint16_t)((DZ_SIDE > 0 ? drive.compare_a : drive.compare_b) ^ with_dither(plan, found.law, up));
    found.unlike |= DZ_SIDE > 0 ? drive.compare_b : drive.compare_a;
#else
    (void)plan, (void)ready, (void)status, (void)care;
#endif
    return found;
}

#endif
