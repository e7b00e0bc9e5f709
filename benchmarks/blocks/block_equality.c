/* The core in block form beside the one in fixed form, both called as black boxes: every pair of a command and a
 * difference of pressure codes, each with another pair of pressures that makes it, and codes that no signal has.
 *
 * DZ_FIRST, DZ_STRIDE and DZ_END say which differences; `int` may have 16 bits here. */
#include "dz_calibration.h"
#include "edges.h"
#include "machine.h"

#define ROWS ((2 * (int32_t)DZ_ADC_CODE_MAX) + 1)
#define EDGES (sizeof edges / sizeof edges[0])
/* 2^16 over the golden ratio: spreads the pairs that the differences begin with. */
#define SPREAD UINT32_C(40503)
#define BETA_EVERY 16u

uint16_t dz_comp_fixed(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_status_fixed(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_beta_fixed(uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_comp_block(const struct dz_calibration *block, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_status_block(const struct dz_calibration *block, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_beta_block(const struct dz_calibration *block, uint16_t p_a_adc, uint16_t p_b_adc);

extern const struct dz_calibration dz_block;

struct found {
    uint32_t inputs, edge_inputs, unlike_compare, unlike_status, unlike_beta;
    uint16_t first[3];
    uint64_t hash;
};

static struct found found;

/* Four outputs at a time, for an AVR has no quick product of 64 bits; of the last codes beyond the converter's up to
 * three are only compared. */
static void take(uint16_t output)
{
    static uint64_t four;
    static uint8_t count;

    four = (four << 16) | output;
    count++;
    if (count == 4u) {
        found.hash = (found.hash ^ four) * UINT64_C(0x100000001B3);
        found.hash ^= found.hash >> 32;
        count = 0u;
    }
}

static void note(uint32_t *unlike, uint16_t u, uint16_t a, uint16_t b)
{
    if (found.unlike_compare + found.unlike_status + found.unlike_beta == 0u) {
        found.first[0] = u;
        found.first[1] = a;
        found.first[2] = b;
    }
    *unlike += 1u;
}

static void try_input(uint16_t u, uint16_t a, uint16_t b, uint8_t with_beta)
{
    const uint16_t compare = dz_comp_block(&dz_block, u, a, b);
    const uint16_t status = dz_status_block(&dz_block, u, a, b);

    take(compare);
    if (compare != dz_comp_fixed(u, a, b)) {
        note(&found.unlike_compare, u, a, b);
    }
    if (status != dz_status_fixed(u, a, b)) {
        note(&found.unlike_status, u, a, b);
    }
    if (with_beta != 0u) {
        const uint16_t beta = dz_beta_block(&dz_block, a, b);

        take(beta);
        take(status);
        if (beta != dz_beta_fixed(a, b)) {
            note(&found.unlike_beta, u, a, b);
        }
    }
}

/* Every command at one difference, A less B. */
static void try_row(int32_t difference)
{
    const uint16_t pairs = (uint16_t)((int32_t)DZ_ADC_CODE_MAX + 1 - (difference < 0 ? -difference : difference));
    const uint16_t b_low = (uint16_t)(difference < 0 ? -difference : 0);
    const uint32_t row = (uint32_t)(difference + (int32_t)DZ_ADC_CODE_MAX);
    uint16_t pair = (uint16_t)(((row * SPREAD) & 0xFFFFu) % pairs);

    for (uint16_t u = 0u; u <= DZ_ADC_CODE_MAX; u++) {
        const uint16_t b = (uint16_t)(b_low + pair);

        try_input(u, (uint16_t)((uint16_t)difference + b), b, ((u ^ row) % BETA_EVERY) == 0u);
        pair++;
        pair = (pair == pairs) ? 0u : pair;
    }
    found.inputs += (uint32_t)DZ_ADC_CODE_MAX + 1u;
}

static void program(void)
{
    for (int32_t row = DZ_FIRST; row < ROWS && row < DZ_END; row += DZ_STRIDE) {
        try_row(row - (int32_t)DZ_ADC_CODE_MAX);
    }
    for (uint8_t u = 0u; u < EDGES; u++) {
        for (uint8_t a = 0u; a < EDGES; a++) {
            for (uint8_t b = 0u; b < EDGES; b++) {
                try_input(edges[u], edges[a], edges[b], 1u);
                found.edge_inputs++;
            }
        }
    }
    put(found.inputs);
    put(found.edge_inputs);
    put(found.unlike_compare);
    put(found.unlike_status);
    put(found.unlike_beta);
    put(found.first[0]);
    put(found.first[1]);
    put(found.first[2]);
    put((uint32_t)(found.hash >> 32));
    put((uint32_t)found.hash);
}
