/* What is asked of a firmware's own block beside dz_calibration_check(): the octets that its C links, how many they are,
 * and the words of the header, of which any other value is refused. */
#include <stddef.h>
#include <string.h>

#include "dz_block.h"

#define WORD(member) offsetof(struct dz_calibration, member)

uint32_t dz_size(void)
{
    return (uint32_t)sizeof dz_block;
}

void dz_linked(unsigned char *octets)
{
    memcpy(octets, &dz_block, sizeof dz_block);
}

void dz_header(uint16_t *places)
{
    static const uint16_t words[] = {
        WORD(magic), WORD(magic) + 2u, WORD(layout), WORD(length), WORD(shape), WORD(code_max), WORD(compare_max),
        WORD(sample_Hz), WORD(tick_Hz), WORD(beta_step),
    };

    memcpy(places, words, sizeof words);
}
