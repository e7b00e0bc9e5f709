/* The plant over a PWM period, on and then off, by CasADi's Runge-Kutta step (plant_step.h, generated; part of this unit,
 * so that it is inlined). A step that meets a stop, which swallows the spool's speed, or the metering edge, where the
 * equations have a kink, is shortened to it; so is one in which the current lets go of a stop. */
#ifndef PLANT_H
#define PLANT_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define CASADI_SYMBOL_EXPORT static inline
#include "plant_step.h"

/* A stop or the edge is met where the spool is as close to it as this share of the stroke. */
#define CLOSE 1e-14
#define MOST_TRIES 60
/* Steps that end early in one phase; more are chatter at a stop. */
#define EVENTS 16
#define NEAR 4

enum { CURRENT, POSITION, SPEED, TRAVEL, STATES };

struct plant
{
    const double *p;     /* see numbers_of() of plant.py */
    const double *curve; /* the recorded characteristic, see plant_curve.h; none: the edge is that of Eq. (24) */
    int32_t counts;      /* of the compare value in a period */
    double state[STATES]; /* A, m, m/s; m s since the period began */
    double charge;       /* A s since the period began */
    int open;            /* on which side of the edge; a plant in which nothing depends on the position has none */
    double supply_MPa;
    double acts; /* acceleration by preload and pressure drop where the spool is, m/s^2; known at a stop */
    double shut; /* the same of a shut edge */
    double play; /* play of the magnetic force, V of command */
    double mean; /* mean current of the last period, V of command */
    double bias; /* drive that is added to the plant's, V of command */
    double push; /* acceleration by the play and by that drive, m/s^2 */
    double dp_MPa;
    double flow; /* L/min */
    const double *below; /* the recorded tests on both sides of the pressure drop, */
    const double *above;
    double share_above; /* how far towards the upper one, */
    double beyond_MPa;  /* and how far beyond both, */
    double q_max;       /* the largest flow there, L/min, */
    double share;       /* and the share of it that flows */
};

/* What depends on the position. */
static inline void act(struct plant *plant)
{
    const casadi_real *arg[3] = {&plant->state[POSITION], &plant->supply_MPa, plant->p};
    casadi_real *res[3] = {&plant->acts, &plant->dp_MPa, &plant->flow};

    (void)plant_acting(arg, res, 0, 0, 0);
}

/* What ends a step early: a position, a turn of the spool, a current that no longer holds it at a stop. */
enum event { MEETS, TURNS, LEAVES };

/* Below zero before the event, above zero after it; `to` is the position that is met. */
static double past(const struct plant *plant, const double *state, enum event event, double to, double from)
{
    const double *p = plant->p;

    if (event == MEETS) {
        return from * (state[POSITION] - to);
    }
    if (event == TURNS) {
        return from * state[SPEED];
    }
    return from * (p[PLANT_PULL] * state[CURRENT] + plant->acts + plant->push - p[PLANT_SPRING] * state[POSITION]);
}

/* How a spool is: shut, past the edge, held by a stop. */
enum flight { SHUT, OPEN, HELD };

static inline void step(const struct plant *plant, enum flight flight, double h, double voltage, double *end)
{
    const double push = plant->push + ((flight == SHUT) ? plant->shut : 0.0);
    const casadi_real *arg[6] = {plant->state, &h, &voltage, &push, &plant->supply_MPa, plant->p};
    casadi_real *res[1] = {end};

    if (flight == SHUT) {
        (void)plant_shut(arg, res, 0, 0, 0);
    } else if (flight == OPEN) {
        (void)plant_open(arg, res, 0, 0, 0);
    } else {
        (void)plant_held(arg, res, 0, 0, 0);
    }
}

/* Shortens a step of h, past an event at its end, until it ends just past it: by the secant, with halves where that leads
 * astray. A current that just does not let go yet would be asked again and again. */
static double shorten(const struct plant *plant, enum flight flight, double h, double voltage, enum event event,
                      double to, double from, double *end)
{
    double before_s = 0.0, after_s = h;
    double before = past(plant, plant->state, event, to, from);
    double after = past(plant, end, event, to, from);
    /* The position is flat where it turns, so that a time to 1e-9 is enough there. */
    const double close = (event == MEETS)   ? CLOSE * plant->p[PLANT_STROKE_M]
                         : (event == TURNS) ? 1e-9 * (after - before)
                                            : CLOSE * (after - before);
    int last = 0;

    for (int32_t tried = 0; (tried < MOST_TRIES) && (after > close); tried++) {
        double at_s = before_s + (after_s - before_s) * before / (before - after);
        double at;

        if (!((before < 0.0) && (at_s > before_s) && (at_s < after_s)) || (tried % 4 == 3)) {
            at_s = 0.5 * (before_s + after_s);
        }
        if ((at_s <= before_s) || (at_s >= after_s)) {
            break;
        }
        step(plant, flight, at_s, voltage, end);
        at = past(plant, end, event, to, from);
        if (at > 0.0) {
            before *= (last > 0) ? 0.5 : 1.0; /* Illinois: an end that stays counts for half */
            after_s = at_s;
            after = at;
            last = 1;
        } else {
            after *= (last < 0) ? 0.5 : 1.0;
            before_s = at_s;
            before = at;
            last = -1;
        }
    }
    step(plant, flight, after_s, voltage, end);
    return after_s;
}

static inline int at_stop(const struct plant *plant)
{
    return (plant->state[POSITION] <= 0.0) || (plant->state[POSITION] >= plant->p[PLANT_STROKE_M]);
}

/* Whether a free spool is at a stop, or may come to one within the next steps. */
static inline int is_near(const struct plant *plant, double h)
{
    const double reach = 2.0 * fabs(plant->state[SPEED]) * h, x = plant->state[POSITION];

    return (x <= reach) || (x >= plant->p[PLANT_STROKE_M] - reach);
}

/* Moves for h, or to the first event; returns for how long. */
static inline double move(struct plant *plant, double h, double voltage)
{
    const double *p = plant->p, stroke = p[PLANT_STROKE_M];
    const int linear = p[PLANT_LINEAR] > 0.5;
    const double low = (plant->open && !linear) ? p[PLANT_OVERLAP_M] : 0.0;
    const double high = (plant->open || linear) ? stroke : p[PLANT_OVERLAP_M];
    const enum flight flight = (plant->open && !linear) ? OPEN : SHUT;
    const double x = plant->state[POSITION], v = plant->state[SPEED];
    double end[STATES];
    double reach, to = 0.0, from = 0.0;

    if (at_stop(plant)) {
        const double away = (x <= 0.0) ? 1.0 : -1.0;

        if (past(plant, plant->state, LEAVES, x, away) <= 0.0) {
            step(plant, HELD, h, voltage, end);
            if (past(plant, end, LEAVES, x, away) > 0.0) {
                h = shorten(plant, HELD, h, voltage, LEAVES, x, away, end);
            }
            memcpy(plant->state, end, sizeof end);
            return h;
        }
    }
    h = is_near(plant, h) ? h / NEAR : h;
    step(plant, flight, h, voltage, end);
    reach = (fabs(v) + fabs(end[SPEED])) * h;
    if ((v * end[SPEED] < 0.0) && (end[POSITION] >= low) && (end[POSITION] <= high) &&
        ((fmin(x, end[POSITION]) - reach < low) || (fmax(x, end[POSITION]) + reach > high))) {
        /* It may have been there and back: then it turned beyond. */
        double turned[STATES];
        double turn_s;

        memcpy(turned, end, sizeof end);
        turn_s = shorten(plant, flight, h, voltage, TURNS, 0.0, (v < 0.0) ? 1.0 : -1.0, turned);
        if ((turned[POSITION] < low) || (turned[POSITION] > high)) {
            memcpy(end, turned, sizeof end);
            h = turn_s;
        }
    }
    if (end[POSITION] < low) {
        to = low;
        from = -1.0;
    } else if (end[POSITION] > high) {
        to = high;
        from = 1.0;
    }
    if (from * from > 0.0) {
        h = shorten(plant, flight, h, voltage, MEETS, to, from, end);
        end[POSITION] = to;
        if ((to > 0.0) && (to < stroke)) {
            plant->open = from > 0.0;
        } else {
            end[SPEED] = 0.0;
        }
        memcpy(plant->state, end, sizeof end);
        act(plant);
        return h;
    }
    memcpy(plant->state, end, sizeof end);
    return h;
}

/* A part of the period at one voltage, in steps as short as the plant's fastest motion asks for. */
static inline void phase(struct plant *plant, double seconds, double voltage)
{
    const double *p = plant->p;
    const int32_t steps = (int32_t)ceil(seconds * p[PLANT_STEPS_PER_S]);
    const double h = seconds / steps, before = plant->state[CURRENT];
    double left = seconds;

    for (int32_t taken = 0; (taken < NEAR * steps + EVENTS) && (left > CLOSE * seconds); taken++) {
        left -= move(plant, fmin(left, h), voltage);
    }
    if (left > CLOSE * seconds) { /* to and fro at a stop: it stays there for the rest of the phase */
        double end[STATES];

        step(plant, HELD, left, voltage, end);
        memcpy(plant->state, end, sizeof end);
    }
    /* Eqs. (19) to (21), integrated: they do not feel the spool. */
    plant->charge += (p[PLANT_DRIVE] * voltage * seconds - (plant->state[CURRENT] - before)) / p[PLANT_DECAY];
}

#endif
