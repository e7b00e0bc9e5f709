/* What else the core says: of codes that are not sound, in its status word, and as beta for a display. */
#include "called.h"
#include "every_input.h"
#include "march.h"

/* Whether an input gives what is expected, whatever its status, which dz_check_status() tries. */
static uint16_t gives(const struct dz_plan *plan, const struct dz_drive *ready, uint16_t u_adc, struct dz_pair pair,
                      uint16_t expected)
{
    const struct called found = call(plan, ready, u_adc, pair.a, pair.b, 0, 0);

    return found.law == expected && found.unlike == 0u;
}

/* Every `stride`-th code of 16 bits as command, at each pair of pressures: without a sound command nothing is driven,
 * without sound pressures the law's safe end. */
void dz_check_fallbacks(const struct dz_plan *plan, const uint8_t DZ_TABLE *prepared, struct dz_findings *findings)
{
    const struct dz_part DZ_TABLE *laws = (const struct dz_part DZ_TABLE *)(prepared + plan->laws_at);
    const struct dz_pair DZ_TABLE *pairs = (const struct dz_pair DZ_TABLE *)(prepared + plan->pairs_at);
    const struct dz_drive ready = run_in();

    for (int32_t index = 0; index < plan->pairs; index++) {
        const struct dz_pair pair = pairs[index];
        struct march at = start_march(plan, &laws[plan->safe_law * plan->parts]);

        for (int32_t place = 0; place < plan->codes; place += plan->stride) {
            uint16_t expected = 0;

            march(&at, plan, place + 1 - at.place, &expected, 0);
            if (!pair.sound || place < plan->sound_from || place >= plan->sound_to) {
                findings->bad_fallbacks += !gives(plan, &ready, code_at(plan, place), pair, expected);
                findings->calls++;
            }
        }
        for (int32_t code = INT32_C(65535); code >= plan->codes; code -= plan->stride) {
            findings->bad_fallbacks += !gives(plan, &ready, (uint16_t)code, pair, 0u);
            findings->calls++;
        }
    }
}

static uint16_t outside(int32_t code, int32_t low, int32_t high)
{
    return code < low || code > high;
}

/* What the status says of the difference of two sound pressure codes. */
static uint16_t of_difference(const struct dz_plan *plan, int32_t difference)
{
    return (uint16_t)((difference < -plan->reverse ? 8u : 0u) + (difference > plan->tested_to ? 16u : 0u));
}

/* Every `stride`-th code of each input, with the others at the ends of their sound codes. */
void dz_check_status(const struct dz_plan *plan, const int32_t DZ_TABLE *slant, struct dz_findings *findings)
{
    const int32_t u_first = code_at(plan, plan->sound_from), u_last = code_at(plan, plan->sound_to - 1);
    const int32_t low[3] = {u_first < u_last ? u_first : u_last, plan->a_low, plan->b_low};
    const int32_t high[3] = {u_first < u_last ? u_last : u_first, plan->a_high, plan->b_high};

    for (int16_t moving = 0; moving < 3; moving++) {
        for (int16_t ends = 0; ends < 8; ends++) {
            int32_t code[3];

            if ((ends >> moving) & 1) {
                continue; /* the moving one has no end */
            }
            for (int16_t input = 0; input < 3; input++) {
                code[input] = ((ends >> input) & 1) ? high[input] : low[input];
            }
            for (code[moving] = 0; code[moving] <= INT32_C(65535); code[moving] += plan->stride) {
                const uint16_t a = outside(code[1], low[1], high[1]), b = outside(code[2], low[2], high[2]);
                uint16_t expected = (uint16_t)(outside(code[0], low[0], high[0]) + (plan->ahead_bit * a) + (plan->behind_bit * b));

                /* Of pressures that are not sound the difference says nothing. */
                if (!a && !b) {
                    expected = (uint16_t)(expected + of_difference(plan, code[1] - slant[code[2]]));
                }
                findings->bad_status +=
                    DZ_STATUS((uint16_t)code[0], (uint16_t)code[1], (uint16_t)code[2]) != expected;
                findings->calls++;
            }
        }
    }
}
/* What is shown of beta: at the first, the last and another pair of each difference, and where it can't be right. What
 * the status says of that difference, too. */
void dz_check_betas(const struct dz_plan *plan, const uint8_t DZ_TABLE *prepared, struct dz_findings *findings)
{
    const struct dz_row DZ_TABLE *rows = (const struct dz_row DZ_TABLE *)(prepared + plan->rows_at);
    const struct dz_pair DZ_TABLE *pairs = (const struct dz_pair DZ_TABLE *)(prepared + plan->pairs_at);
    const int32_t DZ_TABLE *slant = (const int32_t DZ_TABLE *)(prepared + plan->slant_at);
    const uint16_t DZ_TABLE *betas = (const uint16_t DZ_TABLE *)(prepared + plan->betas_at);

    for (int32_t index = 0; index < plan->rows; index++) {
        const struct dz_row row = rows[index];
        const uint16_t beta = betas[row.law], last = (uint16_t)(row.b_low + row.pairs - 1u);
        const uint16_t tried[3] = {row.b_low, last, (uint16_t)(row.b_low + row.first)};

        for (int16_t k = 0; row.pairs != 0u && k < 3; k++) {
            const uint16_t p_a = (uint16_t)(row.offset + slant[tried[k]]);

            findings->bad_betas += DZ_BETA(p_a, tried[k]) != beta;
            findings->bad_status +=
                DZ_STATUS((uint16_t)plan->zero_code, p_a, tried[k]) != of_difference(plan, row.offset);
        }
    }
    for (int32_t index = 0; index < plan->pairs; index++) {
        const struct dz_pair pair = pairs[index];

        findings->bad_betas += !pair.sound && DZ_BETA(pair.a, pair.b) != betas[plan->safe_law];
    }
}
