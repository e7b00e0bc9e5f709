/* Half of all values are at or beside the ends that matter, of edges.h; the rest are anything. Three of four periods
 * go on from the last one, with new inputs, of those with a fault one of eight; the others from any state. */
#include <stddef.h>

#include "current_states.h"
#include "edges.h"

static uint32_t random_state;

static uint32_t any(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}

/* Neighbouring seeds must not begin alike: an odd number that spreads over all bits. */
static void begin(uint32_t seed)
{
    random_state = ((seed << 1) | 1u) * 0x9E3779B1u;
}

static uint16_t drawn(const uint16_t *edges, uint16_t count)
{
    const uint32_t random = any();

    if ((random & 1u) != 0u) {
        return (uint16_t)(edges[(random >> 8) % count] + (uint16_t)((random >> 4) % 5u) - 2u);
    }
    return (uint16_t)(random >> 16);
}

static uint32_t offset_in_use(const struct dz_current *loop)
{
#if SHUNTS == 2
    return (loop->on_b == 0u) ? loop->offset_a : loop->offset_b;
#else
    return loop->offset;
#endif
}

/* The set points: of two solenoids mostly that of the one that the controller has, or the other one, or both, or none. */
static void draw_set_points(const struct dz_current *loop, uint16_t set_point, uint16_t *set_points)
{
    set_points[0] = set_point;
    set_points[1] = 0u;
#if SOLENOIDS == 2
    const uint32_t random = any();
    const unsigned has = (loop->on_b != 0u) ? 1u : 0u;
    const unsigned asked = ((random & 0x300u) == 0u) ? 1u - has : has;

    set_points[asked] = set_point;
    set_points[1u - asked] = ((random & 0x3C00u) == 0u) ? (uint16_t)(random >> 16) : 0u;
#else
    (void)loop;
#endif
}

static void any_state(struct dz_current *loop)
{
    const uint32_t random = any();

    dz_current_init(loop);
    switch (random & 3u) {
    case 0u:
        loop->integral = (any() % ((2u * INTEGRAL_END) + 1u)) - INTEGRAL_END;
        break;
    case 1u:
        loop->integral = (any() % 1000u) - INTEGRAL_END;
        break;
    case 2u:
        loop->integral = INTEGRAL_END - (any() % 1000u);
        break;
    default:
        loop->integral = (any() % 200000u) - 100000u;
        break;
    }
    loop->faults = ((random & 0x70u) == 0u) ? (random >> 8) & 31u : 0u;
#if SHUNTS == 2
    loop->offset_a = drawn(offset_edges, COUNT(offset_edges));
    loop->offset_b = drawn(offset_edges, COUNT(offset_edges));
#else
    loop->offset = drawn(offset_edges, COUNT(offset_edges));
#endif
#if SOLENOIDS == 2
    loop->on_b = ((random & 0x2000u) != 0u) ? 0xFFFFFFFFu : 0u;
    loop->held_ticks = drawn(held_tick_edges, COUNT(held_tick_edges));
    loop->faults <<= ((random & 0x4000u) != 0u) ? 8u : 0u;
#endif
    loop->compare = ((random & 0x18000u) == 0u) ? 0u : drawn(compare_edges, COUNT(compare_edges));
    loop->over_ticks = drawn(over_tick_edges, COUNT(over_tick_edges));
    loop->open_ticks = drawn(open_tick_edges, COUNT(open_tick_edges));
    loop->ramped = drawn(set_point_edges, COUNT(set_point_edges));
}

static uint32_t folded(uint32_t hash, uint32_t word)
{
    return (((hash << 5) | (hash >> 27)) ^ word) * 0x9E3779B1u;
}

static uint32_t hash_of(uint32_t hash, const struct dz_current *loop)
{
    hash = folded(hash, loop->integral);
    hash = folded(hash, (loop->compare << 16) | loop->faults);
    hash = folded(folded(hash, loop->over_ticks), loop->open_ticks);
    hash = folded(hash, loop->ramped);
#if SOLENOIDS == 2
    hash = folded(folded(hash, (loop->compare_a << 16) | loop->compare_b), loop->on_b ^ loop->held_ticks);
#endif
#if SHUNTS == 2
    return folded(folded(hash, (loop->offset_a << 16) | loop->offset_ticks), loop->offset_b);
#else
    return folded(hash, (loop->offset << 16) | loop->offset_ticks);
#endif
}

uint32_t current_states(uint32_t seed, uint32_t count, struct period *periods)
{
    struct dz_current loop;
    uint32_t hash = seed;

    begin(seed);
    for (uint32_t k = 0u; k < count; k++) {
        uint16_t set_point, sum, supply, set_points[2];
        struct dz_current before;

        if ((k == 0u) || ((any() & 0x300u) == 0u) || ((loop.faults != 0u) && ((any() & 0x7000u) != 0u))) {
            any_state(&loop);
        }
        set_point = drawn(set_point_edges, COUNT(set_point_edges));
        if ((any() & 0x300u) == 0u) { /* a step of the rate at most */
            set_point = (uint16_t)(loop.ramped + (uint16_t)(any() % (2u * RATE_EDGE + 9u)) - (uint16_t)(RATE_EDGE + 4u));
        }
        draw_set_points(&loop, set_point, set_points);
        sum = ((any() & 0xC00u) == 0u) ? drawn(sum_edges, COUNT(sum_edges))
                                       : (uint16_t)(offset_in_use(&loop) + (drawn(above_edges, COUNT(above_edges)) >> 1));
        supply = drawn(supply_edges, COUNT(supply_edges));
        before = loop;
        TICK(&loop, set_points, sum, supply);
        hash = hash_of(hash, &loop);
        if (periods != NULL) {
            periods[k] = (struct period){before, loop, {set_points[0], set_points[1]}, sum, supply};
        }
    }
    return hash;
}

uint32_t current_offsets(uint32_t seed, uint32_t count, struct dz_current *ends, uint16_t *sums)
{
    uint32_t hash = seed;

    begin(seed);
    for (uint32_t k = 0u; k < count; k++) {
        struct dz_current loop;

        /* Of four calibrations three lie about one value, their mean at half a code: the ends that matter are met. */
        const uint16_t about = drawn(offset_edges, COUNT(offset_edges));
        const int scattered = (any() & 0x300u) == 0u;

        dz_current_init(&loop);
        hash = hash_of(hash, &loop);
        /* Faults that stand already must stay: every combination of them. */
        loop.faults |= (2u * k) & (DZ_CURRENT_SENSOR | DZ_CURRENT_OPEN | DZ_CURRENT_SHORT | DZ_CURRENT_OVER);
        for (uint16_t tick = 0u; tick <= DZ_CURRENT_OFFSET_TICKS; tick++) {
            const uint16_t sum = scattered ? drawn(offset_edges, COUNT(offset_edges))
                                           : (uint16_t)(about + ((any() >> 8) & 1u));

            dz_current_calibrate(&loop, sum);
            hash = hash_of(hash, &loop);
            if (sums != NULL) {
                *sums = sum;
                sums++;
            }
        }
        if (ends != NULL) {
            ends[k] = loop;
        }
    }
    return hash;
}

void current_initial(struct dz_current *loop)
{
    dz_current_init(loop);
}
