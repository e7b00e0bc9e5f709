/* Stands in for the coil where the law's output is the PWM's duty. */
#ifndef COIL_H
#define COIL_H

#include <stddef.h>
#include <stdint.h>

struct coil
{
    double rated_A;
};

struct sensor
{
    double V_per_A;
};

struct coil_run
{
    const struct coil *coil;
};

static inline void coil_at_rest(struct coil_run *run, const struct coil *coil, const struct sensor *sensor)
{
    (void)sensor;
    run->coil = coil;
}

static inline double coil_period(struct coil_run *run, uint16_t set_point)
{
    (void)run;
    (void)set_point;
    return 0.0;
}

#endif
