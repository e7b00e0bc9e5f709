/* Drive functions and current controller in block form beside those in fixed form, call by call over long sequences:
 * after every call the two states are the same to the bit. Functions of the fixed form end with _fixed.
 *
 * SEED, SAMPLES (of the drive) and TICKS (of the current controller) say how long; `int` may have 16 bits here. */
#include <stddef.h>
#include <string.h>

#include "edges.h"
#include "machine.h"
#include "dz_calibration.h"

#define COUNT(edges) ((uint16_t)(sizeof(edges) / sizeof((edges)[0])))

extern const struct dz_calibration dz_block;

static uint32_t random_state = SEED;
static uint32_t steps, unlike, first;
static uint64_t hash;

static uint32_t any(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state >> 3;
}

static uint16_t below(uint16_t limit)
{
    return (uint16_t)((any() & 0xFFFFu) % limit);
}

/* Octets from one to behind another of a state of each form; not 0: they differ. */
static uint8_t differs_within(const void *block, const void *fixed, size_t from, size_t to)
{
    const uint8_t *octets = block, *others = fixed;
    uint8_t differs = 0u;

    for (size_t at = from; at < to; at++) {
        differs |= octets[at] ^ others[at];
        hash = (hash << 5) ^ (hash >> 59) ^ octets[at];
    }
    return differs;
}

static void count(uint8_t differs)
{
    steps++;
    if (differs != 0u && unlike++ == 0u) {
        first = steps;
    }
}

/* ---- the drive ---- */

#if SAMPLES
#include "dz_drive.h"

void dz_drive_init_fixed(struct dz_drive *drive);
void dz_drive_sample_fixed(struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
void dz_drive_tick_fixed(struct dz_drive *drive);

/* Compilers put nothing or two octets ahead of `ramped`, which are none of the state. */
static void compare(const struct dz_drive *block, const struct dz_drive *fixed)
{
    const uint8_t ahead = differs_within(block, fixed, 0u, offsetof(struct dz_drive, played) + sizeof block->played);
    const uint8_t from_ramp = differs_within(block, fixed, offsetof(struct dz_drive, ramped), sizeof *block);

    count(ahead | from_ramp);
}

/* Held with noise, rising or falling steadily, at corners, or anywhere; for some samples each. */
static uint16_t next_code(uint16_t code, uint32_t way, const uint16_t *edges, uint16_t number)
{
    uint16_t next = code;

    switch (way & 7u) {
    case 0u:
    case 1u:
        next = (uint16_t)(code + below(5u) - 2u);
        break;
    case 2u:
        next = (uint16_t)(code + 1u + below(9u));
        break;
    case 3u:
        next = (uint16_t)(code - 1u - below(9u));
        break;
    case 4u:
    case 5u:
        next = edges[below(number)];
        break;
    case 6u:
        next = (uint16_t)(edges[below(number)] + below(3u) - 1u);
        break;
    default:
        next = below(DZ_ADC_CODE_MAX + 1u);
        break;
    }
    return ((way & 0x3F00u) == 0u) ? (uint16_t)any() : next;
}

static uint16_t clipped(uint16_t code, uint16_t low, uint16_t high)
{
    return (uint16_t)(code < low ? low : code > high ? high : code);
}

/* Makes codes valid, and the pressure ahead of the edge that is driven the higher one, unlike spans too. */
static void make_sound(uint16_t *code, uint16_t zero_first, uint16_t turned)
{
    const uint16_t low = code[1] < code[2] ? code[1] : code[2], high = code[1] < code[2] ? code[2] : code[1];

    code[0] = clipped(zero_first != 0u ? dz_block.command_zero : code[0], dz_block.command_low, dz_block.command_high);
    code[1] = clipped(turned != 0u ? (uint16_t)(low / 4u) : high, dz_block.sensors[0].low, dz_block.sensors[0].high);
    code[2] = clipped(turned != 0u ? high : low, dz_block.sensors[1].low, dz_block.sensors[1].high);
}

static void run_drive(void)
{
    static struct dz_drive block, fixed;
    static const uint16_t *const edges[3] = {command_edges, a_edges, b_edges};
    static const uint16_t counts[3] = {COUNT(command_edges), COUNT(a_edges), COUNT(b_edges)};
    uint16_t code[3] = {0u, 0u, 0u}, left[3] = {0u, 0u, 0u};
    uint32_t way[3] = {0u, 0u, 0u};

    for (uint32_t sample = 0u; sample < SAMPLES; sample++) {
        if (sample % 4096u == 0u) {
            memset(&block, 0xA5, sizeof block);
            memset(&fixed, 0xA5, sizeof fixed);
            dz_drive_init(&dz_block, &block);
            dz_drive_init_fixed(&fixed);
            compare(&block, &fixed);
        }
        for (uint8_t k = 0u; k < 3u; k++) {
            if (left[k] == 0u) {
                way[k] = any();
                left[k] = (uint16_t)(1u + below((way[k] & 0x30000u) == 0u ? 2000u : (way[k] & 0x10000u) != 0u ? 4u : 60u));
                code[k] = (way[k] & 0xC0000u) != 0u ? edges[k][below(counts[k])] : code[k];
            }
            left[k]--;
            code[k] = next_code(code[k], way[k], edges[k], counts[k]);
            if ((way[k] & 0x3F00u) == 0u) {
                left[k] = 0u; /* any code of 16 bits is seldom valid: once */
            }
        }
        /* Of four parts three are sound but for a fault now and then, and begin with the zero command that is waited for. */
        if ((sample & 0x3000u) != 0u && (any() & ((sample & 0x1000u) != 0u ? 0xFFu : 0xFFFFu)) != 0u) {
            const uint16_t zero_first = (sample & 0xFF0u) == 0u;

            make_sound(code, zero_first, SWAPPED && block.side < 0);
        }
        dz_drive_sample(&dz_block, &block, code[0], code[1], code[2]);
        dz_drive_sample_fixed(&fixed, code[0], code[1], code[2]);
        compare(&block, &fixed);
        for (uint16_t ticks = below(4u); ticks != 0u; ticks--) {
            dz_drive_tick(&dz_block, &block);
            dz_drive_tick_fixed(&fixed);
            compare(&block, &fixed);
        }
    }
}
#endif

/* ---- the current controller ---- */

#if TICKS
#include "dz_current.h"
#include "tick.h"

void dz_current_init_fixed(struct dz_current *loop);
void dz_current_calibrate_fixed(struct dz_current *loop, uint16_t sum);

static struct dz_current by_block, by_fixed;

static void compare_loops(void)
{
    count(differs_within(&by_block, &by_fixed, 0u, sizeof by_block));
}

static void calibrate_both(void)
{
    const uint16_t about = offset_edges[below(COUNT(offset_edges))];

    memset(&by_block, 0xA5, sizeof by_block);
    memset(&by_fixed, 0xA5, sizeof by_fixed);
    dz_current_init(&dz_block, &by_block);
    dz_current_init_fixed(&by_fixed);
    compare_loops();
    for (uint16_t sums = 0u; sums <= OFFSET_SUMS; sums++) {
        const uint16_t sum = (uint16_t)(about + below(2u));

        dz_current_calibrate(&dz_block, &by_block, sum);
        dz_current_calibrate_fixed(&by_fixed, sum);
        compare_loops();
    }
}

/* The sum of codes of a coil whose current follows the last compare value; seldom one that it can't have. */
static uint16_t sum_of(uint32_t *flow, uint32_t way)
{
    *flow += ((uint32_t)(uint16_t)by_block.compare * FULL_SUM >> 4) - (*flow >> 4);
    if ((way & 0x7F00u) == 0u) {
        return (uint16_t)(sum_edges[below(COUNT(sum_edges))] + below(3u) - 1u);
    }
    return (uint16_t)(OFFSET_NOMINAL + (*flow >> 16) + below(3u));
}

static void run_current(void)
{
    uint32_t flow = 0u, way = 0u;
    uint16_t set_point = 0u, left = 0u, after_fault = 0u, corner = 0u, supply = supply_edges[0];

    calibrate_both();
    for (uint32_t tick = 0u; tick < TICKS; tick++) {
        uint16_t sum, asked[2] = {0u, 0u};

        after_fault = (by_block.faults != 0u) ? (uint16_t)(after_fault + 1u) : 0u;
        if (after_fault > 12u) {
            calibrate_both();
            flow = 0u;
        }
        if (left == 0u) {
            way = any();
            left = (uint16_t)(1u + below((way & 3u) == 0u ? 3u : 200u));
            set_point = ((way & 12u) == 0u) ? (uint16_t)any()
                                            : (uint16_t)(set_point_edges[below(COUNT(set_point_edges))] + below(2u));
            corner = ((way & 0xF0u) == 0u) ? sum_edges[below(COUNT(sum_edges))] : 0u;
            supply = ((way & 0x100u) == 0u) ? supply_edges[below(COUNT(supply_edges))] : (uint16_t)any();
        }
        left--;
        sum = (corner != 0u) ? (uint16_t)(corner + below(3u) - 1u) : sum_of(&flow, any());
        supply = (uint16_t)(supply + below(3u) - 1u);
        asked[(way >> 9) % SOLENOIDS] = set_point;
        TICK_BOTH(asked, sum, supply);
        compare_loops();
    }
}
#endif

static void program(void)
{
#if SAMPLES
    run_drive();
#endif
#if TICKS
    run_current();
#endif
    put(steps);
    put(unlike);
    put(first);
    put((uint32_t)(hash >> 32));
    put((uint32_t)hash);
}
