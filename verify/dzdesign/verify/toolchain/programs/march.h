/* The law, place by place, as exact integers that advance by addition with carry. */
#ifndef MARCH_H
#define MARCH_H

#include "every_input.h"

struct march {
    int64_t remainder, carry, denominator;
    int32_t quotient, step;
    int32_t place, end; /* the next one; behind the last of the part */
    int32_t part;
    const struct dz_part DZ_TABLE *parts;
};

static inline void enter_part(struct march *at, const struct dz_plan *plan, int32_t part)
{
    const struct dz_part DZ_TABLE *from = &at->parts[part];

    at->part = part;
    at->end = plan->part_end[part];
    at->denominator = plan->denominator[part];
    at->remainder = from->remainder;
    at->carry = from->carry;
    at->quotient = from->quotient;
    at->step = from->step;
}

static inline struct march start_march(const struct dz_plan *plan, const struct dz_part DZ_TABLE *parts)
{
    struct march at;

    at.parts = parts;
    at.place = 0;
    enter_part(&at, plan, 0);
    return at;
}

static inline uint16_t limited(int32_t value, int32_t limit)
{
    value = value < 0 ? 0 : value;
    return (uint16_t)(value > limit ? limit : value);
}

/* The next `count` expected compare values, `apart` from each other; 0 apart the last one stays. */
static inline void march(struct march *at, const struct dz_plan *plan, int32_t count, uint16_t *expected, int16_t apart)
{
    const int32_t limit = plan->compare_limit, last = at->place + count;

    while (at->place < last) {
        const int32_t end = at->end < last ? at->end : last;
        const int64_t carry = at->carry, denominator = at->denominator, less = carry - denominator;
        const int32_t step = at->step;
        int64_t remainder = at->remainder - denominator; /* below zero: the carry shows in the sign */
        int32_t quotient = at->quotient;

        for (int32_t k = at->place; k < end; k++) {
            const int64_t on = remainder + carry, back = remainder + less;

            *expected = limited(quotient, limit);
            expected += apart;
            quotient += step + (on >= 0);
            remainder = on >= 0 ? back : on;
        }
        at->remainder = remainder + denominator;
        at->quotient = quotient;
        at->place = end;
        if (end == at->end && end < plan->codes) {
            enter_part(at, plan, at->part + 1);
        }
    }
}

static inline uint16_t code_at(const struct dz_plan *plan, int32_t place)
{
    return (uint16_t)(plan->first_code + (place * plan->code_step));
}

#endif
