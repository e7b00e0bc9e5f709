/* Hashes of blocks of states on another machine, one number each. */
#include <stddef.h>

#include "current_states.h"
#include "machine.h"

static void program(void)
{
    for (uint32_t block = 0u; block < BLOCKS; block++) {
        put(current_states(block + SEED, BLOCK, NULL));
    }
    put(current_offsets(SEED, OFFSETS, NULL, NULL));
}
