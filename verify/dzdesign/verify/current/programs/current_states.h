/* States and inputs of the current controller, the same on every machine, and what it makes of them. */
#ifndef CURRENT_STATES_H
#define CURRENT_STATES_H

#include <stdint.h>

#include "dz_current.h"

#ifdef DZ_CALIBRATION_WORDS
#include "bound.h"
#endif
#include "tick.h"

/* A period: what stood before, what came in, what stands after. */
struct period
{
    struct dz_current before;
    struct dz_current after;
    uint16_t set_points[2];
    uint16_t sum;
    uint16_t supply;
};

/* Runs `count` periods from a seed, keeps them in `periods` unless that is NULL, and returns a hash of the states. */
uint32_t current_states(uint32_t seed, uint32_t count, struct period *periods);

/* The same for calibrations: DZ_CURRENT_OFFSET_TICKS + 1 sums each, the last state of each is kept. */
uint32_t current_offsets(uint32_t seed, uint32_t count, struct dz_current *ends, uint16_t *sums);

/* The state before anything. */
void current_initial(struct dz_current *loop);

#endif
