/* Written by dzdesign 1.0.0 from template dz_store.c.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours and does not check it. */

/* Two copies of a calibration block in RAM, lost without supply: see dz_store.h for what to put here in its place. */
#include <string.h>

#include "dz_store.h"

static struct dz_slot slots[DZ_STORE_SLOTS];

void dz_store_init(void)
{
    uint16_t slot;

    /* TI's start-up code leaves memory as it was: what looks like a block there may be half of one. */
    for (slot = 0u; slot < DZ_STORE_SLOTS; slot++)
    {
        (void)dz_store_erase(slot);
    }
}

const struct dz_slot *dz_store_slot(uint16_t slot)
{
    return &slots[slot];
}

uint16_t dz_store_erase(uint16_t slot)
{
    (void)memset(&slots[slot], -1, sizeof slots[slot]); /* all bits 1, whatever the size of a char */
    return DZ_STORE_DONE;
}

uint16_t dz_store_write(uint16_t slot, uint16_t at, const uint16_t *words, uint16_t count)
{
    unsigned char *const first = (unsigned char *)&slots[slot];

    (void)memcpy(&first[at * sizeof words[0]], words, count * sizeof words[0]);
    return DZ_STORE_DONE;
}
