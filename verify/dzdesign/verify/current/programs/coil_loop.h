/* A coil in a loop with the current controller. */
#ifndef COIL_LOOP_H
#define COIL_LOOP_H

#include <stdint.h>

#include "dz_current.h"
#include "tick.h"

struct coil
{
    double resistance_ohm; /* with switch and shunt */
    double inductance_H;
    double supply_V;
    double freewheel_V; /* drop of the diode */
    double start_A;
    double period_s;
    double full_counts;     /* PWM counts of a duty of one */
    int32_t samples;        /* of the current in a period, at the middles of equal parts */
    int32_t samples_before; /* of them before the interrupt */
};

struct sensor
{
    double V_per_A;
    double offset_V;
    double codes_per_V;
    double code_max;
    double supply_divider;
};

struct trace
{
    double mean_A; /* over the period */
    uint16_t compare;
    uint16_t sum; /* what the interrupt in it was given */
    uint16_t unused[2];
};

/* Runs `count` periods from `start_A`, calibrated; returns the faults. */
int32_t coil_loop(const struct coil *coil, const struct sensor *sensor, const uint16_t *set_points, uint32_t count,
                  struct trace *traces);

#endif
