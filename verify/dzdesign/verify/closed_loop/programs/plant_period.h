/* The plant over one PWM period, on and then off: whole where it is free throughout, else in pieces. */
#ifndef PLANT_PERIOD_H
#define PLANT_PERIOD_H

#include "plant_curve.h"

/* Past the edge, each phase that is not taken whole is moved in so many pieces. */
#define PIECES 8
/* The step is exact of an acceleration straight in the position: what is not, as at the edge, which is a kink, may be
 * this share of what the interpolation may leave unexplained. */
#define CURVED 0.001

/* What the current's ripple may move a spool within a period beyond what its speeds at both ends tell, m: a bound. */
static inline double ripple_m(const struct plant *plant)
{
    const double *p = plant->p;
    const double on = (double)plant->compare / (double)plant->counts;
    const double ripple_A = p[PLANT_DRIVE] * p[PLANT_U_MAX_V] * p[PLANT_PERIOD_S] * on * (1.0 - on);

    return 0.5 * p[PLANT_PULL] * ripple_A * p[PLANT_PERIOD_S] * p[PLANT_PERIOD_S];
}

/* Whether no straight line over the position, from the period's start through its end, meets the middle value. */
static inline int is_curved(const struct plant *plant, double x, double middle, double end_acts, double excess)
{
    const double moved = x - plant->x;
    const double line = (end_acts - plant->acts) * (middle - 0.5 * (plant->x + x));

    return fabs(excess * moved - line) > CURVED * plant->p[PLANT_JUMP] * fabs(moved);
}

/* A period that may be taken whole, in one piece: 0. Otherwise nothing moves, and it needs so many pieces a phase. */
static inline int32_t whole_period(struct plant *plant, int linear, double *charge, double *at_middle)
{
    const double *p = plant->p;
    double i, x, v, middle, end, near;
    double end_acts = 0.0;
    double excess = 0.0;

    if (linear) {
        const casadi_real *arg[7] = {&plant->i, &plant->x, &plant->v, plant->response, &plant->acts, &plant->push, p};
        casadi_real *res[5] = {&i, &x, &v, charge, &middle};

        (void)plant_step_linear(arg, res, 0, 0, 0);
    } else {
        const casadi_real *arg[8] = {&plant->i,    &plant->x,    &plant->v,          plant->response,
                                     &plant->acts, &plant->push, &plant->supply_MPa, p};
        casadi_real *res[7] = {&i, &x, &v, charge, &middle, &end, &excess};

        (void)plant_step(arg, res, 0, 0, 0);
        end_acts = end - plant->push;
    }
    /* Further than this from a stop it can't have been there and back. */
    near = (fabs(plant->v) + fabs(v)) * p[PLANT_PERIOD_S] + ripple_m(plant);
    if ((fmin(fmin(plant->x, x), middle) <= near) ||
        (fmax(fmax(plant->x, x), middle) >= p[PLANT_STROKE_M] - near)) {
        return (!linear && (fmax(plant->x, x) >= p[PLANT_OVERLAP_M] - near)) ? PIECES : 1;
    }
    if (!linear && ((fabs(excess) > p[PLANT_JUMP]) || is_curved(plant, x, middle, end_acts, excess))) {
        return PIECES;
    }
    plant->i = i;
    plant->x = x;
    plant->v = v;
    *at_middle = middle;
    if (!linear) {
        act(plant);
        plant->acts = end_acts; /* which the next period need not wait for */
    }
    return 0;
}

/* What full voltage leaves of a plant at rest after so many half counts: after a coarse time, and a fine one more. */
static inline struct response response_after(const struct plant *plant, int32_t half_counts)
{
    const double *then = &plant->coarse[4 * (half_counts / PLANT_FINE)];
    const double *fine = &plant->fine[12 * (half_counts % PLANT_FINE)];
    const struct response response = {
        fine[0] * then[0] + fine[8],
        fine[2] * then[0] + fine[3] * then[1] + fine[4] * then[2] + fine[9],
        fine[5] * then[0] + fine[6] * then[1] + fine[7] * then[2] + fine[10],
        fine[1] * then[0] + then[3] + fine[11],
    };

    return response;
}

/* Whether a spool at a stop stays there through the period: by the current's largest value, or its least. */
static inline int held(const struct plant *plant, double after)
{
    if (plant->x > 0.0) {
        return (pulled(plant, plant->i) > 0.0) && (pulled(plant, after) > 0.0);
    }
    /* Where it is switched off: not told by what is left of it in the end, of a fast coil the last bits of a number. */
    return (pulled(plant, plant->i) < 0.0) &&
           (pulled(plant, plant->i + plant->on * (1.0 - plant->p[PLANT_PER_SETTLED] * plant->i)) < 0.0);
}

/* What full voltage adds in a share of a period, at its end, to where the middle value stands (motion.py). */
static inline double balance(const struct plant *plant, double share)
{
    const double *terms = &plant->p[PLANT_BALANCE_0];
    double value = 0.0;

    for (int term = BALANCE_TERMS - 1; term >= 0; term--) {
        value = value * share + terms[term];
    }
    return value;
}

/* What the voltage adds in a period of this compare value: the rest of a whole one's, as off is all that comes after. */
static inline void respond(struct plant *plant, int32_t compare)
{
    const int32_t off_half = plant->counts - 2 * compare;
    const struct response off = response_after(plant, 2 * (plant->counts - compare));

    plant->compare = compare;
    plant->on = response_after(plant, 2 * compare).i;
    plant->response[0] = plant->all.i - off.i;
    plant->response[1] = plant->all.x - off.x;
    plant->response[2] = plant->all.v - off.v;
    plant->response[3] = plant->all.charge - off.charge;
    if (plant->p[PLANT_LINEAR] > 0.5) {
        plant->response[4] = plant->half_x - ((off_half > 0) ? response_after(plant, off_half).x : 0.0);
    } else {
        plant->response[4] = balance(plant, 1.0) - balance(plant, (double)(plant->counts - compare) / plant->counts);
    }
}

/* Another pressure drop at no flow. */
static inline void plant_supply(struct plant *plant, double supply_MPa)
{
    const double *p = plant->p;
    const double x = plant->x;

    if ((supply_MPa < plant->supply_MPa) || (supply_MPa > plant->supply_MPa)) {
        plant->supply_MPa = supply_MPa;
        plant->x = p[PLANT_STROKE_M];
        act(plant);
        plant->flow_a_metre = plant->flow / (p[PLANT_STROKE_M] - p[PLANT_OVERLAP_M]);
        plant->x = x;
        act(plant);
        if (plant->curve) {
            curve_supply(plant);
            curve_passes(plant); /* the flow sags the new supply as it did the old one */
        }
    }
}

/* curve: a recorded characteristic, or none. */
static void plant_at_rest(struct plant *plant, const double *p, const double *coarse, const double *fine,
                          const double *curve, int32_t counts, double supply_MPa)
{
    const struct plant rest = {
        .p = p, .coarse = coarse, .fine = fine, .curve = curve, .counts = counts, .supply_MPa = -1.0};

    *plant = rest;
    plant->all = response_after(plant, 2 * counts);
    plant->half_x = response_after(plant, counts).x;
    respond(plant, 0);
    plant_supply(plant, supply_MPa);
}

/* linear: nothing that acts depends on the position, and the pressure drop is constant. */
static inline void plant_period(struct plant *plant, int32_t compare, int linear)
{
    const double *p = plant->p;
    const double low = plant->mean - p[PLANT_HALF_PLAY_V];
    const double high = plant->mean + p[PLANT_HALF_PLAY_V];
    const double before = plant->x;
    double charge = 0.0;
    double middle = before;

    if (compare != plant->compare) {
        respond(plant, compare);
    }
    plant->play = (plant->play < low) ? low : ((plant->play > high) ? high : plant->play);
    plant->push = (plant->play - plant->mean + plant->bias) * p[PLANT_PUSH];
    if (at_stop(plant)) {
        const double after = p[PLANT_I_I] * plant->i + plant->response[0];

        if (held(plant, after)) {
            charge = p[PLANT_Q_I] * plant->i + plant->response[3];
            plant->i = after;
        } else {
            /* An edge that a spool from rest may come to within the period, or one that is open. */
            const int edge_at_stop = !linear && ((plant->x > 0.0) || (p[PLANT_OVERLAP_M] <= p[PLANT_REACH_M]));

            charge = period_in_pieces(plant, compare, (edge_at_stop ? PIECES : 1) * (int32_t)p[PLANT_STEPS]);
        }
    } else {
        const int32_t steps = (int32_t)p[PLANT_STEPS];
        const int32_t pieces = (!linear && (steps > 1)) ? PIECES : whole_period(plant, linear, &charge, &middle);

        if (pieces > 0) {
            charge = period_in_pieces(plant, compare, pieces * steps);
            middle = 0.5 * (before + plant->x);
        }
    }
    if (linear && plant->curve) {
        /* The PWM's ripple stands out of it, as it does of a meter's reading. */
        curve_flow(plant, 0.25 * before + 0.5 * middle + 0.25 * plant->x);
    } else if (linear) {
        const double opening = plant->x - p[PLANT_OVERLAP_M];

        plant->flow = plant->flow_a_metre * ((opening > 0.0) ? opening : 0.0);
    }
    plant->mean = charge * p[PLANT_VOLTS_PER_CHARGE];
}

#endif
