/* Every pair of command code and pressure-difference code against the exactly rounded law.
 *
 * Along a part of a row of constant pressure the law is start + slope * u; both are given as quotient and remainder over one
 * denominator, so the law's rounded value comes from addition with carry. Nothing is shared with the code under test.
 */
#include "exact_rows.h"
#ifdef __arm__
#include "semihosting.h"
#else
#include <stdio.h>
static void put_number(uint32_t value) { printf(" %lu", (unsigned long)value); }
static void put_text(const char *text) { fputs(text, stdout); }
#endif

uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);

int main(void)
{
    uint32_t inputs = 0u, wrong = 0u, largest = 0u;

    for (int32_t dp = -PRESSURE_MAX; dp <= PRESSURE_MAX; dp++) {
        const struct exact_row *row = &rows[(dp + PRESSURE_MAX) * PARTS];
        int32_t part = 0;
        int64_t remainder = row->start_remainder;
        int32_t quotient = row->start_quotient;

        for (int32_t u = 0; u <= COMMAND_MAX; u++) {
            if (part + 1 < PARTS && u == part_from[part + 1]) { /* the law's parts meet: each begins where it says */
                part++;
                row++;
                remainder = row->start_remainder;
                quotient = row->start_quotient;
            }
            const int32_t expected = quotient < 0 ? 0 : quotient > COMPARE_MAX ? COMPARE_MAX : quotient;
            /* The pair of pressures stands low in its range for even commands, high for odd ones. */
            const int32_t spare = PRESSURE_MAX - (dp < 0 ? -dp : dp);
            const int32_t p_b = (dp < 0 ? -dp : 0) + ((u & 1) ? spare : 0);
            const int32_t found = dz_comp((uint16_t)u, (uint16_t)(p_b + dp), (uint16_t)p_b);
            const uint32_t error = (uint32_t)(found > expected ? found - expected : expected - found);

            inputs++;
            if (error != 0u) {
                wrong++;
                largest = error > largest ? error : largest;
            }
            remainder += row->slope_remainder;
            quotient += row->slope_quotient;
            if (remainder >= DENOMINATOR) {
                remainder -= DENOMINATOR;
                quotient++;
            }
        }
    }
    put_number(inputs);
    put_number(wrong);
    put_number(largest);
    put_text("\n");
    return 0;
}
