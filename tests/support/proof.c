/* What Frama-C's Eva is asked of a core: no codes and no state of drive or current controller make any of it undefined;
 * and IN_BLOCK_FORM no octets of a block either, whatever dz_calibration_check() says. */
#include <stdint.h>

#include "__fc_builtin.h"
#include "dz_drive.h"
#ifdef WITH_CURRENT
#include "dz_current.h"
#endif

#ifdef IN_BLOCK_FORM
static struct dz_calibration block;
#define BLOCK &block,
#else
#define BLOCK
#endif

static void any_block(void)
{
#ifdef IN_BLOCK_FORM
    Frama_C_make_unknown((char *)&block, sizeof block);
#endif
}

static uint16_t anything(void)
{
    return (uint16_t)Frama_C_unsigned_long_interval(0u, 65535u);
}

static uint32_t any_word(void)
{
    return ((uint32_t)anything() << 16) | anything();
}

void law(void)
{
    const uint16_t u = anything(), a = anything(), b = anything();
    uint16_t status;

    any_block();
    (void)dz_comp(BLOCK u, a, b);
    (void)dz_comp_checked(BLOCK any_word(), any_word(), any_word());
    (void)dz_beta(BLOCK a, b);
    status = dz_status(BLOCK u, a, b);
    /*@ assert status: status <= 31; */
#ifdef BIPOLAR
    (void)dz_comp_negative(BLOCK u, a, b);
    (void)dz_comp_checked_negative(BLOCK any_word(), any_word(), any_word());
    (void)dz_beta_negative(BLOCK a, b);
    status = dz_status_negative(BLOCK u, a, b);
    /*@ assert status_negative: status <= 31; */
#endif
}

#ifdef IN_BLOCK_FORM
void check(void)
{
    any_block();
    (void)dz_calibration_check(&block);
}
#endif

void drive(void)
{
    struct dz_drive drive;

    any_block();
    dz_drive_init(BLOCK &drive);
    drive.compare_a = anything();
    drive.compare_b = anything();
    drive.status = anything();
    drive.law = anything();
    drive.side = (int16_t)Frama_C_interval(-32767, 32767);
    drive.ticks = anything();
    drive.at_rest = anything();
    drive.rising = anything();
    drive.played = (int16_t)Frama_C_interval(-32767, 32767);
    drive.ramped = (int32_t)Frama_C_interval(-32767, 32767) * INT32_C(65536) + (int32_t)anything();
    drive.valid_commands = anything();
    drive.valid_pressures = anything();
    drive.faulty_commands = anything();
    drive.faulty_pressures = anything();
    if (Frama_C_interval(0, 1)) {
        dz_drive_sample(BLOCK &drive, anything(), anything(), anything());
    } else {
        dz_drive_tick(BLOCK &drive);
    }
}
#ifdef WITH_CURRENT

void current(void)
{
    struct dz_current loop;

    any_block();
    dz_current_init(BLOCK &loop);
    loop.integral = any_word();
    loop.offset_total = any_word();
    loop.offset_ticks = any_word();
    loop.offset = any_word();
    loop.compare = any_word();
    loop.faults = any_word();
    loop.over_ticks = any_word();
    loop.open_ticks = any_word();
    loop.ramped = any_word();
    if (Frama_C_interval(0, 1)) {
        dz_current_calibrate(BLOCK &loop, anything());
    } else {
#ifdef WITH_SUPPLY
        dz_current_tick(BLOCK &loop, anything(), anything(), anything());
#else
        dz_current_tick(BLOCK &loop, anything(), anything());
#endif
    }
}
#endif
