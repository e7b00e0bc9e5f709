/* Calls the compiled core over whole ranges, so that Python sees rows and not single calls. */
#include <stdint.h>

uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT
#endif

/* One row: all differences of pressure codes from -code_max to code_max. With `high` the pair of pressure codes stands
 * as high in its range as the difference allows, without it as low. */
EXPORT void dz_fill_row(uint16_t u_adc, int32_t code_max, int32_t high, uint16_t *out)
{
    for (int32_t dp = -code_max; dp <= code_max; dp++) {
        const int32_t low_a = dp > 0 ? dp : 0;
        const int32_t p_a = high ? code_max + (dp < 0 ? dp : 0) : low_a;
        out[dp + code_max] = dz_comp(u_adc, (uint16_t)p_a, (uint16_t)(p_a - dp));
    }
}

/* All pairs of pressure codes at one command: how many differ from the row of their difference. */
EXPORT int64_t dz_count_odd_pairs(uint16_t u_adc, int32_t code_max, const uint16_t *row)
{
    int64_t odd = 0;
    for (int32_t p_a = 0; p_a <= code_max; p_a++) {
        for (int32_t p_b = 0; p_b <= code_max; p_b++) {
            odd += dz_comp(u_adc, (uint16_t)p_a, (uint16_t)p_b) != row[p_a - p_b + code_max];
        }
    }
    return odd;
}

/* All commands at one pair of pressure codes. */
EXPORT void dz_fill_column(uint16_t p_a_adc, uint16_t p_b_adc, int32_t u_count, uint16_t *out)
{
    for (int32_t u_adc = 0; u_adc < u_count; u_adc++) {
        out[u_adc] = dz_comp((uint16_t)u_adc, p_a_adc, p_b_adc);
    }
}
