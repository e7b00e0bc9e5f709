/* Calls the compiled core over whole ranges, so that Python sees rows and not single calls. */
#include <stdint.h>

uint16_t DZ_CORE(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT
#endif

/* One row: one command at `count` pairs of pressure codes. */
EXPORT void dz_fill_row(uint16_t u_adc, int32_t count, const uint16_t *p_a, const uint16_t *p_b, uint16_t *out)
{
    for (int32_t k = 0; k < count; k++) {
        out[k] = DZ_CORE(u_adc, p_a[k], p_b[k]);
    }
}

/* All pairs of pressure codes up to code_max at one command: how many differ from the value of their place. */
EXPORT int64_t dz_count_odd_pairs(uint16_t u_adc, int32_t code_max, const int32_t *place, const uint16_t *value)
{
    int64_t odd = 0;
    for (int32_t p_a = 0; p_a <= code_max; p_a++) {
        for (int32_t p_b = 0; p_b <= code_max; p_b++) {
            odd += DZ_CORE(u_adc, (uint16_t)p_a, (uint16_t)p_b) != value[*place];
            place++;
        }
    }
    return odd;
}

/* Commands 0, 1, ... at one pair of pressure codes. */
EXPORT void dz_fill_column(uint16_t p_a_adc, uint16_t p_b_adc, int32_t u_count, uint16_t *out)
{
    for (int32_t u_adc = 0; u_adc < u_count; u_adc++) {
        out[u_adc] = DZ_CORE((uint16_t)u_adc, p_a_adc, p_b_adc);
    }
}

#ifdef DZ_STATUS
uint16_t dz_status(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);

/* The status word at `count` inputs. */
EXPORT void dz_fill_status(int32_t count, const uint16_t *u, const uint16_t *p_a, const uint16_t *p_b, uint16_t *out)
{
    for (int32_t k = 0; k < count; k++) {
        out[k] = dz_status(u[k], p_a[k], p_b[k]);
    }
}
#endif
