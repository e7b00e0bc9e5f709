/* Every input of the compiled core against the exactly rounded law, in one pass with all that must hold of it.
 *
 * The law comes as exact integers: a quotient and a remainder that advance by addition with carry. The core is called
 * as the interrupt does, see called.h, and never seen: it is objects of its own. `int` may have 16 bits here.
 */
#include "called.h"
#include "every_input.h"
#include "march.h"

/* By itself, so that the linker can lay it beside the core: an emulator's jumps are quick within a page. */
#define NEAR __attribute__((noinline))
#define ALL_BITS 0xFFFFu
#define HASH_START UINT64_C(0xCBF29CE484222325)
#define HASH_FACTOR UINT64_C(0x100000001B3)

/* ---- hash and comparison ---- */

static uint64_t hashed_word(uint64_t hash, uint16_t first, uint16_t second, uint16_t third, uint16_t fourth)
{
    const uint32_t low = first | ((uint32_t)second << 16), high = third | ((uint32_t)fourth << 16);

    hash = (hash ^ (low | ((uint64_t)high << 32))) * HASH_FACTOR;
    return hash ^ (hash >> 32);
}

/* Four values at a time; what is missing to the last four is 0. */
NEAR static uint64_t hashed(uint64_t hash, const uint16_t *values, int32_t count)
{
    for (; count >= 4; count -= 4) {
        hash = hashed_word(hash, values[0], values[1], values[2], values[3]);
        values += 4;
    }
    if (count > 0) {
        hash = hashed_word(hash, values[0], count > 1 ? values[1] : 0u, count > 2 ? values[2] : 0u, 0u);
    }
    return hash;
}

/* The input at a place of a row: each command has another pair of pressures that makes the row's difference. */
static struct called call_at(const struct dz_plan *plan, const struct dz_drive *ready, const struct dz_row *row,
                             const int32_t DZ_TABLE *slant, int32_t place)
{
    const uint16_t p_b = (uint16_t)(row->b_low + (uint16_t)(((int32_t)row->first + place) % (int32_t)row->pairs));

    return call(plan, ready, code_at(plan, place), (uint16_t)(row->offset + slant[p_b]), p_b,
                status_at(plan, row->offset), ALL_BITS);
}

/* What an input gives that is not right: of the core's law, or, where the lowest pair of the difference gives the right
 * one, of the pair; of a right law what the drive makes of it. */
static void note_wrong(const struct dz_plan *plan, const struct dz_drive *ready, const struct dz_row *row,
                       const int32_t DZ_TABLE *slant, int32_t place, struct called found, uint16_t expected,
                       struct dz_findings *findings)
{
    const int32_t error = (int32_t)found.law - (int32_t)expected;
    const uint32_t size = (uint32_t)(error < 0 ? -error : error);
    struct called lowest;

    findings->calls++;
    lowest = call(plan, ready, code_at(plan, place), (uint16_t)(row->offset + slant[row->b_low]), row->b_low,
                  status_at(plan, row->offset), ALL_BITS);
    if (lowest.law == expected && lowest.unlike == 0u) {
        findings->odd++;
        return;
    }
    if (findings->wrong == 0u) {
        findings->first_row = row->offset - plan->lowest;
        findings->first_place = place;
        findings->first_found = found.law;
        findings->first_expected = expected;
    }
    findings->wrong++;
    findings->largest_error = size > findings->largest_error ? size : findings->largest_error;
}

/* ---- all commands at all differences ---- */

/* All commands at one difference, each with another pair of pressures that makes it: not 0 where one is unlike. */
NEAR static uint32_t fill_row(const struct dz_plan *plan, const struct dz_drive *ready, const struct dz_row *row,
                              const int32_t *slant, uint16_t *out)
{
    const uint16_t step = (uint16_t)plan->code_step, status = status_at(plan, row->offset);
    const int32_t offset = row->offset;
    uint16_t u_adc = (uint16_t)plan->first_code;
    int32_t pair = row->first, left = plan->codes;
    uint32_t unlike = 0;

    while (left > 0) {
        const int32_t spare = row->pairs - pair, run = left < spare ? left : spare;
        const int32_t *lean = &slant[row->b_low + pair];
        uint16_t p_b = (uint16_t)(row->b_low + pair);

        for (int32_t k = 0; k < run; k++) {
            const struct called found = call(plan, ready, u_adc, (uint16_t)(offset + lean[k]), p_b, status, ALL_BITS);

            out[k] = found.law;
            unlike |= found.unlike;
            u_adc = (uint16_t)(u_adc + step);
            p_b++;
        }
        out += run;
        left -= run;
        pair = 0;
    }
    return unlike;
}

/* What a row of compare values is like by itself. */
struct row_counts {
    uint32_t above, falls;
};

static struct row_counts counts_of(const struct dz_plan *plan, const uint16_t *out)
{
    const uint16_t limit = (uint16_t)plan->compare_limit;
    struct row_counts counts = {0, 0};

    for (int32_t k = 0; k < plan->codes; k++) {
        counts.above += out[k] > limit;
    }
    for (int32_t k = plan->sound_from + 1; k < plan->sound_to; k++) {
        counts.falls += out[k] < out[k - 1];
    }
    return counts;
}

NEAR static uint32_t differs(const struct dz_plan *plan, const uint16_t *out, const uint16_t *expected)
{
    uint32_t bits = 0;

    for (int32_t k = 0; k < plan->codes; k++) {
        bits |= (uint32_t)(out[k] ^ expected[k]);
    }
    return bits;
}

static void note_differences(const struct dz_plan *plan, const struct dz_drive *ready, const struct dz_row *row,
                             const int32_t *slant, const uint16_t *expected, struct dz_findings *findings)
{
    for (int32_t k = 0; k < plan->codes; k++) {
        const struct called found = call_at(plan, ready, row, slant, k);

        if (found.law != expected[k] || found.unlike != 0u) {
            note_wrong(plan, ready, row, slant, k, found, expected[k], findings);
        }
    }
}

/* Steps from the row before that go against the law's own direction. */
static uint32_t steps_against(const struct dz_plan *plan, const struct dz_direction *direction, const uint16_t *before,
                              const uint16_t *out)
{
    uint32_t against = 0;
    int32_t k = plan->sound_from;

    for (int16_t turn = 0; turn < DZ_MAX_TURNS; turn++) {
        const int32_t end = direction->until[turn];

        if (direction->sign[turn] > 0) {
            for (; k < end; k++) {
                against += out[k] < before[k];
            }
        } else if (direction->sign[turn] < 0) {
            for (; k < end; k++) {
                against += out[k] > before[k];
            }
        }
        k = end > k ? end : k;
    }
    return against;
}

static void check_rows(const struct dz_plan *plan, const uint8_t *prepared, uint16_t *work, uint16_t *at_zero,
                       struct dz_findings *findings)
{
    const struct dz_part *laws = (const struct dz_part *)(prepared + plan->laws_at);
    const struct dz_row *rows = (const struct dz_row *)(prepared + plan->rows_at);
    const struct dz_direction *directions = (const struct dz_direction *)(prepared + plan->directions_at);
    const int32_t *slant = (const int32_t *)(prepared + plan->slant_at);
    const struct dz_drive ready = run_in();
    uint16_t *expected = work, *out = &work[plan->codes], *before = &work[2 * plan->codes];
    struct row_counts counts = {0, 0};
    int32_t law = -1;
    uint32_t known = 0; /* the row before equals `expected` */

    for (int32_t row = 0; row < plan->rows; row++) {
        uint16_t *done;
        uint32_t wrong;

        if (rows[row].pairs == 0u) {
            continue;
        }
        if (rows[row].law != law) { /* `expected` stays where the law does */
            struct march at;

            law = rows[row].law;
            at = start_march(plan, &laws[law * plan->parts]);
            march(&at, plan, plan->codes, expected, 1);
            known = 0;
        }
        wrong = fill_row(plan, &ready, &rows[row], slant, out);
        wrong |= differs(plan, out, expected);
        if (wrong != 0u) {
            note_differences(plan, &ready, &rows[row], slant, expected, findings);
        }
        if (wrong != 0u || known == 0u) { /* else it is value by value the row before, and so are the counts */
            counts = counts_of(plan, out);
            findings->against += steps_against(plan, &directions[row], before, out);
        }
        known = wrong == 0u;
        findings->out_of_range += counts.above;
        findings->falls += counts.falls;
        findings->hash = hashed(findings->hash, out, plan->codes);
        findings->inputs += (uint32_t)plan->codes;
        at_zero[row] = out[plan->zero_place];
        if (wrong != 0u && plan->impatient != 0) {
            return;
        }
        done = before;
        before = out;
        out = done;
    }
    findings->calls += findings->inputs;
}

/* Pressures A from `first` to `last` at one pressure B and zero command: how many give another value than theirs, which
 * stands at `value` and moves by `step`. */
NEAR static void odd_pairs(const struct dz_plan *plan, const struct dz_drive *ready, int32_t first, int32_t last,
                           uint16_t p_b, const uint16_t *value, int32_t step, struct dz_findings *findings)
{
    const uint16_t zero = (uint16_t)plan->zero_code;
    uint32_t odd = 0;

    for (int32_t p_a = first; p_a <= last; p_a++) {
        const struct called found = call(plan, ready, zero, (uint16_t)p_a, p_b, 0, 0);

        odd += found.law != *value || found.unlike != 0u;
        value += step;
    }
    findings->odd += odd;
    findings->calls += (uint32_t)(last - first + 1);
}

/* Once more at zero command, where too much drive would open the valve: every pair of pressure codes that the law
 * follows, and every pair of which one is not sound. */
static void check_cube(const struct dz_plan *plan, const int32_t *slant, const uint16_t *at_zero,
                       struct dz_findings *findings)
{
    const uint16_t safe = (uint16_t)plan->safe_at_zero;
    const struct dz_drive ready = run_in();

    for (int32_t code = 0; code < plan->codes; code++) {
        const uint16_t p_b = (uint16_t)code;
        int32_t low = plan->a_low; /* of pressures ahead whose difference is -reverse or more */

        if (code < plan->b_low || code > plan->b_high) {
            odd_pairs(plan, &ready, 0, plan->codes - 1, p_b, &safe, 0, findings);
            continue;
        }
        low = slant[code] - plan->reverse > low ? slant[code] - plan->reverse : low;
        odd_pairs(plan, &ready, 0, plan->a_low - 1, p_b, &safe, 0, findings);
        if (low <= plan->a_high) {
            const uint16_t *value = &at_zero[low - slant[code] - plan->lowest];

            odd_pairs(plan, &ready, low, plan->a_high, p_b, value, 1, findings);
        }
        odd_pairs(plan, &ready, plan->a_high + 1, plan->codes - 1, p_b, &safe, 0, findings);
    }
}

/* ---- a sample ---- */

/* Some places of some rows, with the same pairs as where all are tried. */
static void check_places(const struct dz_plan *plan, const uint8_t DZ_TABLE *prepared, struct dz_findings *findings)
{
    const struct dz_part DZ_TABLE *laws = (const struct dz_part DZ_TABLE *)(prepared + plan->laws_at);
    const struct dz_row DZ_TABLE *rows = (const struct dz_row DZ_TABLE *)(prepared + plan->rows_at);
    const int32_t DZ_TABLE *slant = (const int32_t DZ_TABLE *)(prepared + plan->slant_at);
    const int32_t DZ_TABLE *places = (const int32_t DZ_TABLE *)(prepared + plan->places_at);
    const struct dz_drive ready = run_in();
    uint16_t out[DZ_MAX_PLACES];

    for (int32_t index = 0; index < plan->rows; index++) {
        const struct dz_row row = rows[index];
        struct march at = start_march(plan, &laws[(int32_t)row.law * plan->parts]);

        for (int32_t k = 0; k < plan->places; k++) {
            const int32_t place = places[k];
            const struct called found = call_at(plan, &ready, &row, slant, place);
            uint16_t expected = 0;

            march(&at, plan, place + 1 - at.place, &expected, 0);
            out[k] = found.law;
            findings->out_of_range += found.law > plan->compare_limit;
            if (found.law != expected || found.unlike != 0u) {
                note_wrong(plan, &ready, &row, slant, place, found, expected, findings);
            }
        }
        findings->hash = hashed(findings->hash, out, plan->places);
        findings->inputs += (uint32_t)plan->places;
    }
    findings->calls += findings->inputs;
}

/* ---- all of it ---- */

static void begin(struct dz_findings *findings)
{
    const struct dz_findings none = {0};

    *findings = none;
    findings->hash = HASH_START;
}

void dz_check_everything(const uint8_t *prepared, uint16_t *work, uint16_t *at_zero, struct dz_findings *findings)
{
    const struct dz_plan *plan = (const struct dz_plan *)prepared;
    const int32_t *slant = (const int32_t *)(prepared + plan->slant_at);

    begin(findings);
    check_rows(plan, prepared, work, at_zero, findings);
    if (plan->cube != 0) {
        check_cube(plan, slant, at_zero, findings);
    }
    dz_check_fallbacks(plan, prepared, findings);
    dz_check_status(plan, slant, findings);
    dz_check_betas(plan, prepared, findings);
}

void dz_check_sample(const uint8_t DZ_TABLE *prepared, struct dz_findings *findings)
{
    const struct dz_plan plan = *(const struct dz_plan DZ_TABLE *)prepared;

    begin(findings);
    check_places(&plan, prepared, findings);
    dz_check_fallbacks(&plan, prepared, findings);
    dz_check_status(&plan, (const int32_t DZ_TABLE *)(prepared + plan.slant_at), findings);
    dz_check_betas(&plan, prepared, findings);
}

void dz_put_findings(const struct dz_findings *findings, void (*put)(uint32_t number))
{
    const uint32_t numbers[] = {
        (uint32_t)(findings->hash >> 32), (uint32_t)findings->hash, findings->inputs, findings->wrong,
        findings->largest_error, findings->out_of_range, findings->falls, findings->against, findings->odd,
        findings->bad_fallbacks, findings->bad_status, findings->bad_betas, findings->calls, (uint32_t)findings->first_row,
        (uint32_t)findings->first_place, (uint32_t)findings->first_found, (uint32_t)findings->first_expected,
    };

    for (uint16_t index = 0; index < sizeof numbers / sizeof numbers[0]; index++) {
        put(numbers[index]);
    }
}
