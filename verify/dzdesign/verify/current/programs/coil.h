/* A coil, its switch and its sensor, the PWM resolved, around the current controller. Between two edges the current is
 * the exponential that it is, so nothing is left out but the doubles' rounding. */
#ifndef COIL_H
#define COIL_H

#include <math.h>
#include <stdint.h>

#include "dz_current.h"

#ifdef DZ_CALIBRATION_WORDS
#include "bound.h"
#endif
#include "tick.h"

#define MOST_SAMPLES 16

struct coil
{
    double resistance_ohm; /* with switch and shunt */
    double inductance_H;
    double supply_V;
    double freewheel_V; /* drop of the diode */
    double period_s;
    double full_counts;     /* PWM counts of a duty of one */
    double rated_A;         /* current of full_counts as a set point */
    int32_t samples;        /* of the current in a period, at the middles of equal parts */
    int32_t samples_before; /* of them before the interrupt */
    int32_t stuck;          /* the switch stays on, whatever the PWM says */
};

struct sensor
{
    double V_per_A;
    double offset_V;
    double codes_per_V;
    double code_max;
    double supply_divider;
};

/* A coil on its way, with its controller. */
struct coil_run
{
    const struct coil *coil;
    const struct sensor *sensor;
    double rate;          /* of the current's decay, 1/s */
    double decay[2];      /* over a part of the period, and over half of one */
    double part_s;        /* a part */
    double on_A;          /* where the current settles with the switch on */
    double off_A;         /* and where it would with it off, did the diode not block */
    double current;
    uint16_t supply_code;
    uint16_t codes[2][MOST_SAMPLES]; /* of this period and the last one, by turns */
    uint16_t sum;                    /* what the last interrupt was given */
    uint32_t periods;
    struct dz_current loop;
};

static inline uint16_t code_of(double volts, const struct sensor *sensor)
{
    const double code = floor(volts * sensor->codes_per_V);

    return (uint16_t)((code < 0.0) ? 0.0 : ((code > sensor->code_max) ? sensor->code_max : code));
}

/* Another coil or supply from here on, at the same current. */
static inline void coil_becomes(struct coil_run *run, const struct coil *coil)
{
    run->coil = coil;
    run->rate = coil->resistance_ohm / coil->inductance_H;
    run->part_s = coil->period_s / coil->samples;
    run->decay[0] = exp(-run->rate * run->part_s);
    run->decay[1] = exp(-run->rate * 0.5 * run->part_s);
    run->on_A = coil->supply_V / coil->resistance_ohm;
    run->off_A = -coil->freewheel_V / coil->resistance_ohm;
    run->supply_code = code_of(coil->supply_V * run->sensor->supply_divider, run->sensor);
}

/* No current; the offset calibrated with as many sums as it takes. */
static inline void coil_at_rest(struct coil_run *run, const struct coil *coil, const struct sensor *sensor)
{
    const struct coil_run rest = {.sensor = sensor};
    const uint16_t no_current = code_of(sensor->offset_V, sensor);

    *run = rest;
    coil_becomes(run, coil);
    dz_current_init(&run->loop);
    for (uint16_t tick = 0u; tick < DZ_CURRENT_OFFSET_TICKS; tick++) {
        dz_current_calibrate(&run->loop, (uint16_t)(no_current * coil->samples));
    }
    for (int32_t sample = 0; sample < coil->samples; sample++) {
        run->codes[1][sample] = no_current;
    }
}

/* Moves the current on for a time in which the part `decay` of it is left, towards where it settles; returns its
 * integral. It does not go below zero: the diode blocks. */
static inline double coil_moves(struct coil_run *run, double settled, double decay, double seconds)
{
    const double start = run->current;
    const double end = settled + (start - settled) * decay;

    if (end >= 0.0) {
        run->current = end;
        return settled * seconds + (start - end) / run->rate;
    }
    run->current = 0.0;
    return settled * log((start - settled) / -settled) / run->rate + start / run->rate;
}

/* A part of the period, or half of one, in which the switch opens at `duty` if it does. */
static inline double coil_part(struct coil_run *run, double from, double until, int half, double duty)
{
    const double seconds = half ? 0.5 * run->part_s : run->part_s;

    if (duty >= until) {
        return coil_moves(run, run->on_A, run->decay[half], seconds);
    }
    if (duty > from) {
        const double on_s = (duty - from) * run->coil->period_s;
        const double charge = coil_moves(run, run->on_A, exp(-run->rate * on_s), on_s);
        const double off_s = seconds - on_s;

        return charge + coil_moves(run, run->off_A, exp(-run->rate * off_s), off_s);
    }
    return coil_moves(run, run->off_A, run->decay[half], seconds);
}

/* A period of the PWM with the compare value in force, and the interrupt in it; returns the mean current. */
static inline double coil_period(struct coil_run *run, uint16_t set_point)
{
    const struct coil *coil = run->coil;
    const int32_t count = coil->samples;
    const double duty = coil->stuck ? 1.0 : run->loop.compare / coil->full_counts;
    uint16_t *const now = run->codes[run->periods & 1u];
    const uint16_t *const last = run->codes[(run->periods & 1u) ^ 1u];
    double from = 0.0, charge = 0.0;
    uint16_t sum = 0u;

    for (int32_t sample = 0; sample < count; sample++) {
        const double until = (sample + 0.5) / count;

        charge += coil_part(run, from, until, sample == 0, duty);
        from = until;
        now[sample] = code_of(run->sensor->offset_V + run->current * run->sensor->V_per_A, run->sensor);
        /* The interrupt has the codes of the last period from the time of day on that it comes at. */
        sum = (uint16_t)(sum + ((sample < coil->samples_before) ? now[sample] : last[sample]));
    }
    charge += coil_part(run, from, 1.0, 1, duty);
    TICK(&run->loop, set_point, sum, run->supply_code);
    run->sum = sum;
    run->periods++;
    return charge / coil->period_s;
}

#endif
