/* The plant over one PWM period, and at rest. */
#ifndef PLANT_PERIOD_H
#define PLANT_PERIOD_H

#include "coil.h"
#include "plant_curve.h"

/* A current that has decayed below this is none: denormal numbers take a processor a hundred times as long. */
#define LEAST_A 1e-100

/* Another pressure drop at no flow. */
static inline void plant_supply(struct plant *plant, double supply_MPa)
{
    if ((supply_MPa < plant->supply_MPa) || (supply_MPa > plant->supply_MPa)) {
        const double x = plant->state[POSITION];

        plant->supply_MPa = supply_MPa;
        plant->state[POSITION] = 0.0;
        act(plant);
        plant->shut = plant->acts;
        plant->state[POSITION] = x;
        act(plant);
        if (plant->curve) {
            curve_supply(plant);
            curve_passes(plant); /* the flow sags the new supply as it did the old one */
        }
    }
}

/* curve: a recorded characteristic, or none. */
static void plant_at_rest(struct plant *plant, const double *p, const double *curve, int32_t counts, double supply_MPa)
{
    const struct plant rest = {.p = p, .curve = curve, .counts = counts, .open = p[PLANT_OVERLAP_M] <= 0.0,
                               .supply_MPa = -1.0};

    *plant = rest;
    plant_supply(plant, supply_MPa);
}

static inline void plant_period(struct plant *plant, int32_t compare)
{
    const double *p = plant->p;
    const double low = plant->mean - p[PLANT_HALF_PLAY_V];
    const double high = plant->mean + p[PLANT_HALF_PLAY_V];
    const double on = p[PLANT_PERIOD_S] * (double)compare / (double)plant->counts;

    plant->play += p[PLANT_PLAYED] * (fmin(fmax(plant->play, low), high) - plant->play);
    plant->push = (plant->play - plant->mean + plant->bias) * p[PLANT_PUSH];
    plant->charge = plant->state[TRAVEL] = 0.0;
    if (compare > 0) {
        phase(plant, on, p[PLANT_U_MAX_V]);
    }
    if (compare < plant->counts) {
        phase(plant, p[PLANT_PERIOD_S] - on, 0.0);
    }
    plant->state[CURRENT] = (plant->state[CURRENT] < LEAST_A) ? 0.0 : plant->state[CURRENT];
    plant->mean = plant->charge * p[PLANT_VOLTS_PER_CHARGE];
    if (plant->curve) {
        /* At the mean position: the PWM's ripple stands out of it, as it does of a meter's reading. */
        curve_flow(plant, plant->state[TRAVEL] / p[PLANT_PERIOD_S]);
    } else {
        act(plant);
    }
}

/* The plant moved by the true current of a coil, in place of that of its amplifier: dz_current.c and coil.h make it. Over
 * a period the spool feels the current's mean; its ripple, of 0.1 % to 2 % of the rated current, is left out. The plant's
 * own coil holds its current (loop.py gives it the inductance for that), which is set here: as much of the current
 * of full command as the coil has of the rated one. */
static inline void plant_period_of_current(struct plant *plant, double share)
{
    plant->state[CURRENT] = share * plant->p[PLANT_FULL_A];
    plant_period(plant, 0);
    plant->mean = share * plant->p[PLANT_U_MAX_V];
}

#endif
