/* The plant moved by the true current of a coil, in place of that of its amplifier: dz_current.c and coil.h make it.
 * Over a period the spool feels the current's mean; its ripple, of 0.1 % to 2 % of the rated current, is left out. */
#ifndef PLANT_COIL_H
#define PLANT_COIL_H

#include "coil.h"
#include "plant_period.h"

/* The plant's own coil holds its current (motion.py gives it the inductance for that), which is set here: as much of the
 * current of full command as the coil has of the rated one. */
static inline void plant_period_of_current(struct plant *plant, double share, int linear)
{
    const double *p = plant->p;

    plant->i = share / p[PLANT_PER_SETTLED];
    plant_period(plant, 0, linear);
    plant->mean = share * p[PLANT_U_MAX_V];
}

#endif
