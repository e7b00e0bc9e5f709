/* What every accepted calibration block must hold, tried: all commands at some pairs of pressures, each compare value
 * against the law in integers of 128 bits, within its limit, and rising with the command. */
#include <stddef.h>
#include <stdint.h>

#include "dz_comp.h"

typedef __int128 wide;

struct claims {
    uint32_t calls, wrong, above_limit, falls, wraps;
};

#define SHAPE(bit) ((DZ_CALIBRATION_SHAPE & (bit)) != 0u)
/* Which sensor is ahead and which behind: 0 for A. */
#define AHEAD(which) ((which) == 0 ? 0 : SHAPE(4u) ? 1 : SHAPE(8u) ? 2 : 0)
#define BEHIND(which) ((which) == 0 ? 1 : SHAPE(16u) ? 0 : SHAPE(32u) ? 2 : 1)

static int32_t turned(int32_t value, int turn)
{
    return turn < 0 ? -value : value;
}

/* The law from the block's numbers alone: branches and signed numbers of any size. */
static uint32_t exact(const struct dz_calibration *c, int which, int rises, int32_t u, int32_t a, int32_t b,
                      struct claims *claims)
{
    const struct dz_calibration_side *s = &c->sides[which];
    const struct dz_calibration_sensor *p = &c->sensors[AHEAD(which)], *q = &c->sensors[BEHIND(which)];
    const int64_t drop = ((int64_t)(a - p->zero) << 12) - (int64_t)(b - q->zero) * s->weight;
    const int failed = a < p->low || a > p->high || b < q->low || b > q->high || drop < -(int64_t)c->reverse;
    const int64_t dp = drop > 0 ? drop >> 12 : 0;
    const int64_t node = failed ? DZ_CALIBRATION_NODE_MASK : dp / DZ_BETA_STEP, past = failed ? 0 : dp % DZ_BETA_STEP;
    const wide left = DZ_BETA_STEP - past;
    const wide law = left * s->nodes[node].law + (wide)past * s->nodes[node + 1].law;
    const wide zero = left * s->nodes[node].zero + (wide)past * s->nodes[node + 1].zero;
    const int32_t away = turned(u - c->command_zero, rises ? 1 : -1) - c->zero_band;
    const wide k = away < 0 ? 0 : away > s->room ? s->room : away;
    const wide t = k < c->transition_codes ? k : c->transition_codes;
    const wide x = k * c->transition_codes + (wide)c->zero_band * t;
    const wide slope = s->slope > 0x7FFFFFFFu ? (wide)s->slope - ((wide)1 << 32) : (wide)s->slope;
    const wide linear = ((wide)s->linear[1] << 32) | s->linear[0], half = ((wide)s->half[1] << 32) | s->half[0];
    const wide sum = law * (slope * x + s->offset) + linear * x + half -
                     (law - zero) * s->transition * (c->transition_codes - t);
    wide quotient = sum >> 32;

    claims->wraps += sum < 0 || sum >> 63 != 0;
    quotient = quotient < s->quotient_limit ? quotient : s->quotient_limit;
    if (u < c->command_low || u > c->command_high) {
        return 0;
    }
    return (uint32_t)(((quotient * s->reciprocal) >> 32) >> s->reciprocal_shift);
}

static uint32_t drawn;

static int32_t draw(int32_t low, int32_t high)
{
    drawn = drawn * 1664525u + 1013904223u;
    return low + (int32_t)((drawn >> 8) % (uint32_t)(high - low + 1));
}

typedef uint16_t (*core)(const struct dz_calibration *, uint16_t, uint16_t, uint16_t);

static void sweep(const struct dz_calibration *c, core comp, int which, int rises, int32_t a, int32_t b,
                  struct claims *claims)
{
    int32_t before = rises ? 0 : 65535;
    int first = 1;

    for (int32_t u = 0; u <= 65535; u += u > DZ_ADC_CODE_MAX ? 1021 : 1) {
        const uint32_t found = comp(c, (uint16_t)u, (uint16_t)a, (uint16_t)b);
        const int valid = u >= c->command_low && u <= c->command_high;

        claims->calls++;
        claims->wrong += found != exact(c, which, rises, u, a, b, claims);
        claims->above_limit += found > c->compare_limit || found > DZ_COMPARE_MAX;
        if (valid) {
            claims->falls += !first && (rises ? (int32_t)found < before : (int32_t)found > before);
            before = (int32_t)found;
            first = 0;
        }
    }
}

#define FALLING SHAPE(2u)

#ifdef BIPOLAR
#define SIDES 2
static const core laws[SIDES] = {dz_comp, dz_comp_negative};
#else
#define SIDES 1
static const core laws[SIDES] = {dz_comp};
#endif

/* Tries `count` blocks, whatever the check says of them; the claims of each in its place. */
void try_blocks(const struct dz_calibration *blocks, uint32_t count, uint32_t pairs, uint32_t seed,
                struct claims *claims)
{
    drawn = seed;
    for (uint32_t index = 0; index < count; index++) {
        const struct dz_calibration *c = &blocks[index];

        for (uint32_t pair = 0; pair < pairs; pair++) {
            const int anything = pair % 4 == 3;

            for (int which = 0; which < SIDES; which++) {
                const struct dz_calibration_sensor *p = &c->sensors[AHEAD(which)], *q = &c->sensors[BEHIND(which)];
                const int32_t a = anything ? draw(0, 65535) : pair == 0 ? p->high : draw(p->low, p->high);
                const int32_t b = anything ? draw(0, 4095) : pair == 0 ? q->low : draw(q->low, q->high);

                sweep(c, laws[which], which, which == 0 ? !FALLING : FALLING, a, b, &claims[index]);
            }
        }
    }
}
