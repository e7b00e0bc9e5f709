/* The supply's correction of a block against straight lines between its nodes: at how many codes and counts it is not
 * that. */
#include "dz_current.c"

uint32_t wrong_corrections(const struct dz_calibration *block);

uint32_t wrong_corrections(const struct dz_calibration *block)
{
    const struct dz_calibration_current *n = &block->current;
    uint32_t wrong = 0u;

    for (uint32_t code = 0u; code <= 65535u; code += code < 4200u ? 5u : 997u) {
        const uint32_t within = code < n->supply_low ? n->supply_low : code > n->supply_high ? n->supply_high : code;
        const uint64_t place = within - n->supply_low, step = UINT64_C(1) << n->supply_shift, past = place % step;
        const uint16_t *node = &n->supply[place / step];
        const uint64_t factor = (node[0] * (step - past) + node[1] * past) / step;

        for (uint32_t counts = 1u; counts <= 65535u; counts += 32767u) {
            const uint64_t right = (counts * factor + (UINT64_C(1) << (CORRECTION_SHIFT - 1))) >> CORRECTION_SHIFT;

            wrong += corrected(n, counts, (uint16_t)code) != right;
        }
    }
    return wrong;
}
