/* The functions of a core in block form bound to one block, so that a check calls them as those of the fixed form.
 *
 * DZ_COMP, DZ_STATUS and DZ_BETA are the core's functions of one side. Where the machine has files the block comes from
 * one; else it is an object of its own, dz_block. */
#include "dz_comp.h"

#ifdef DZ_HELD
#include <string.h>

static struct dz_calibration dz_block;

/* Takes the block; not 0: `size` octets are none. */
int dz_hold(const void *octets, unsigned long size)
{
    if (size != sizeof dz_block) {
        return 1;
    }
    memcpy(&dz_block, octets, sizeof dz_block);
    return 0;
}
#else
extern const struct dz_calibration dz_block;
#endif

uint16_t dz_bound_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return DZ_COMP(&dz_block, u_adc, p_a_adc, p_b_adc);
}

uint16_t dz_bound_status(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return DZ_STATUS(&dz_block, u_adc, p_a_adc, p_b_adc);
}

uint16_t dz_bound_beta(uint16_t p_a_adc, uint16_t p_b_adc)
{
    return DZ_BETA(&dz_block, p_a_adc, p_b_adc);
}
