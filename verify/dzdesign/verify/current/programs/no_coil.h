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
    double means_A[2];
};

static inline void coil_at_rest(struct coil_run *run, const struct coil *coil, const struct sensor *sensor)
{
    (void)run;
    (void)coil;
    (void)sensor;
}

static inline void coil_period(struct coil_run *run, const uint16_t *set_points)
{
    (void)run;
    (void)set_points;
}

#endif
