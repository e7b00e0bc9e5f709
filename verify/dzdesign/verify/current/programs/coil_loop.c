/* A coil, its switch and its sensor, the PWM resolved, around the current controller. Between two edges the current is
 * the exponential that it is, so nothing is left out but the doubles' rounding. */
#include <math.h>

#include "coil_loop.h"

/* Moves the current on by `seconds` at a voltage; returns its integral over that time. It does not go below zero: the
 * diode blocks. */
static double moved(double *current, double volts, double seconds, const struct coil *coil)
{
    const double settled = volts / coil->resistance_ohm, rate = coil->resistance_ohm / coil->inductance_H;
    const double end = settled + (*current - settled) * exp(-rate * seconds);
    double charge;

    if (end >= 0.0) {
        charge = settled * seconds + (*current - end) / rate;
        *current = end;
    } else {
        const double until_zero = log((*current - settled) / -settled) / rate;

        charge = settled * until_zero + *current / rate;
        *current = 0.0;
    }
    return charge;
}

static uint16_t code_of(double volts, const struct sensor *sensor)
{
    const double code = floor(volts * sensor->codes_per_V);

    return (uint16_t)((code < 0.0) ? 0.0 : ((code > sensor->code_max) ? sensor->code_max : code));
}

/* One period of the PWM: the current at `samples` instants in `codes`, its mean returned. */
static double period(const struct coil *coil, const struct sensor *sensor, double duty, double *current, uint16_t *codes)
{
    const double step = 1.0 / coil->samples;
    double at = 0.0, charge = 0.0;

    for (int part = 0; part <= coil->samples; part++) {
        const double end = (part < coil->samples) ? ((part + 0.5) * step) : 1.0;

        if (at < duty) {
            const double on = (end < duty) ? end : duty;

            charge += moved(current, coil->supply_V, (on - at) * coil->period_s, coil);
            at = on;
        }
        if (at < end) {
            charge += moved(current, -coil->freewheel_V, (end - at) * coil->period_s, coil);
            at = end;
        }
        if (part < coil->samples) {
            codes[part] = code_of(sensor->offset_V + *current * sensor->V_per_A, sensor);
        }
    }
    return charge / coil->period_s;
}

int32_t coil_loop(const struct coil *coil, const struct sensor *sensor, const uint16_t *set_points, uint32_t count,
                  struct trace *traces)
{
    struct dz_current loop;
    uint16_t codes[2][16] = {{0}};
    double current = coil->start_A;
    const uint16_t no_current = code_of(sensor->offset_V, sensor);

    dz_current_init(&loop);
    for (uint16_t tick = 0u; tick < DZ_CURRENT_OFFSET_TICKS; tick++) {
        dz_current_calibrate(&loop, (uint16_t)(no_current * coil->samples));
    }
    for (int sample = 0; sample < coil->samples; sample++) {
        codes[1][sample] = code_of(sensor->offset_V + current * sensor->V_per_A, sensor);
    }
    for (uint32_t k = 0u; k < count; k++) {
        uint16_t *const now = codes[k & 1u], *const last = codes[(k & 1u) ^ 1u];
        uint16_t sum = 0u;

        traces[k].compare = loop.compare;
        traces[k].mean_A = period(coil, sensor, loop.compare / coil->full_counts, &current, now);
        /* The interrupt: the codes of the last period from the time of day on that it comes at, and those of this one. */
        for (int sample = 0; sample < coil->samples; sample++) {
            sum = (uint16_t)(sum + ((sample < coil->samples_before) ? now[sample] : last[sample]));
        }
        TICK(&loop, set_points[k], sum, code_of(coil->supply_V * sensor->supply_divider, sensor));
        traces[k].sum = sum;
    }
    return (int32_t)loop.faults;
}
