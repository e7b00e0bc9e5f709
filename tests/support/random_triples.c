/* A hash of what all functions of the core return at random triples of 16-bit codes; how many are the argument. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_status(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_beta(uint16_t p_a_adc, uint16_t p_b_adc);
#ifdef DZ_BOTH
uint16_t dz_comp_negative(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_status_negative(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_beta_negative(uint16_t p_a_adc, uint16_t p_b_adc);
#endif

static uint64_t hashed(uint64_t hash, uint16_t value)
{
    return (hash ^ value) * UINT64_C(0x100000001B3);
}

int main(int count, char **arguments)
{
    const long triples = count > 1 ? atol(arguments[1]) : 0;
    uint64_t random = 1u, hash = UINT64_C(0xCBF29CE484222325);

    for (long k = 0; k < triples; k++) {
        uint16_t u, a, b;

        random = random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        u = (uint16_t)(random >> 48);
        a = (uint16_t)(random >> 32);
        b = (uint16_t)(random >> 16);
        if ((k & 1) != 0) { /* half of them within 13 bits, so that many are codes of a converter */
            u &= 8191u;
            a &= 8191u;
            b &= 8191u;
        }
        hash = hashed(hashed(hashed(hash, dz_comp(u, a, b)), dz_status(u, a, b)), dz_beta(a, b));
#ifdef DZ_BOTH
        hash = hashed(hashed(hash, dz_comp_negative(u, a, b)), dz_status_negative(u, a, b));
        hash = hashed(hash, dz_beta_negative(a, b));
#endif
    }
    printf("%lu %lu\n", (unsigned long)(hash >> 32), (unsigned long)(hash & UINT64_C(0xFFFFFFFF)));
    return triples > 0 ? 0 : 2;
}
