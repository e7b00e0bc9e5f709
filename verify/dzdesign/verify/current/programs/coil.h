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
    int32_t solenoids;      /* which have it: 1 for A, 2 for B, 3 for both */
};

struct sensor
{
    double V_per_A;
    double offset_V;
    double codes_per_V;
    double code_max;
    double supply_divider;
};

/* The current in a coil. */
struct winding
{
    const struct coil *coil;
    double rate;          /* of the current's decay, 1/s */
    double decay[2];      /* over a part of the period, and over half of one */
    double part_s;        /* a part */
    double on_A;          /* where the current settles with the switch on */
    double off_A;         /* and where it would with it off, did the diode not block */
    double current;
};

/* Coils on their way, with their controller. */
struct coil_run
{
    struct winding windings[SOLENOIDS];
    const struct sensor *sensor;
    uint16_t supply_code;
    uint16_t codes[2][MOST_SAMPLES]; /* of this period and the last one, by turns */
    uint16_t sum;                    /* what the last interrupt was given */
    uint32_t periods;
    double means_A[2]; /* over the last period */
    double both_A;    /* the largest current in it that both solenoids had at once, at the samples */
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
    for (int32_t solenoid = 0; solenoid < SOLENOIDS; solenoid++) {
        struct winding *const winding = &run->windings[solenoid];

        if (((coil->solenoids >> solenoid) & 1) != 0) {
            winding->coil = coil;
            winding->rate = coil->resistance_ohm / coil->inductance_H;
            winding->part_s = coil->period_s / coil->samples;
            winding->decay[0] = exp(-winding->rate * winding->part_s);
            winding->decay[1] = exp(-winding->rate * 0.5 * winding->part_s);
            winding->on_A = coil->supply_V / coil->resistance_ohm;
            winding->off_A = -coil->freewheel_V / coil->resistance_ohm;
        }
    }
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
static inline double coil_moves(struct winding *winding, double settled, double decay, double seconds)
{
    const double start = winding->current;
    const double end = settled + (start - settled) * decay;

    if (end >= 0.0) {
        winding->current = end;
        return settled * seconds + (start - end) / winding->rate;
    }
    winding->current = 0.0;
    return settled * log((start - settled) / -settled) / winding->rate + start / winding->rate;
}

/* A part of the period, or half of one, in which the switch opens at `duty` if it does. */
static inline double coil_part(struct winding *winding, double from, double until, int half, double duty)
{
    const double seconds = half ? 0.5 * winding->part_s : winding->part_s;

    if (duty >= until) {
        return coil_moves(winding, winding->on_A, winding->decay[half], seconds);
    }
    if (duty > from) {
        const double on_s = (duty - from) * winding->coil->period_s;
        const double charge = coil_moves(winding, winding->on_A, exp(-winding->rate * on_s), on_s);
        const double off_s = seconds - on_s;

        return charge + coil_moves(winding, winding->off_A, exp(-winding->rate * off_s), off_s);
    }
    return coil_moves(winding, winding->off_A, winding->decay[half], seconds);
}

/* Share of the period in which a solenoid's switch is on. */
static inline double coil_duty(const struct coil_run *run, int32_t solenoid)
{
#if SOLENOIDS == 2
    const uint32_t compare = (solenoid == 0) ? run->loop.compare_a : run->loop.compare_b;
#else
    const uint32_t compare = run->loop.compare;
#endif
    const struct coil *coil = run->windings[solenoid].coil;

    return coil->stuck ? 1.0 : compare / coil->full_counts;
}

/* Whether the current of a solenoid passes the shunt whose codes are taken. */
static inline int coil_is_sensed(const struct coil_run *run, int32_t solenoid)
{
#if SHUNTS == 2
    return solenoid == ((run->loop.on_b != 0u) ? 1 : 0);
#else
    (void)run;
    (void)solenoid;
    return 1;
#endif
}

/* A period of the PWM with the compare values in force, and the interrupt in it. */
static inline void coil_period(struct coil_run *run, const uint16_t *set_points)
{
    const struct coil *coil = run->windings[0].coil;
    const int32_t count = coil->samples;
    uint16_t *const now = run->codes[run->periods & 1u];
    const uint16_t *const last = run->codes[(run->periods & 1u) ^ 1u];
    double from = 0.0, duties[SOLENOIDS], charges[SOLENOIDS];

    run->sum = 0u;
    run->both_A = 0.0;
    /* The interrupt has the codes of the last period from the time of day on that it comes at. */
    for (int32_t sample = coil->samples_before; sample < count; sample++) {
        run->sum = (uint16_t)(run->sum + last[sample]);
    }
    for (int32_t solenoid = 0; solenoid < SOLENOIDS; solenoid++) {
        duties[solenoid] = coil_duty(run, solenoid);
        charges[solenoid] = 0.0;
    }
    for (int32_t sample = 0; sample < count; sample++) {
        const double until = (sample + 0.5) / count;
        double through_A = 0.0, both_A = HUGE_VAL;

        for (int32_t solenoid = 0; solenoid < SOLENOIDS; solenoid++) {
            struct winding *const winding = &run->windings[solenoid];

            charges[solenoid] += coil_part(winding, from, until, sample == 0, duties[solenoid]);
            through_A += coil_is_sensed(run, solenoid) ? winding->current : 0.0;
            both_A = fmin(both_A, winding->current);
        }
        run->both_A = fmax(run->both_A, both_A);
        from = until;
        now[sample] = code_of(run->sensor->offset_V + through_A * run->sensor->V_per_A, run->sensor);
        run->sum = (uint16_t)(run->sum + ((sample < coil->samples_before) ? now[sample] : 0u));
        if (sample == coil->samples_before - 1) {
            TICK(&run->loop, set_points, run->sum, run->supply_code);
        }
    }
    for (int32_t solenoid = 0; solenoid < SOLENOIDS; solenoid++) {
        charges[solenoid] += coil_part(&run->windings[solenoid], from, 1.0, 1, duties[solenoid]);
        run->means_A[solenoid] = charges[solenoid] / coil->period_s;
    }
    run->periods++;
}

#endif
