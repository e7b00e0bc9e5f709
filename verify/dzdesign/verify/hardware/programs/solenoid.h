/* A solenoid with its switch, freewheeling diode and current sensor: between two edges of the pin the current is the
 * exponential that it is. Times in seconds since the start. */
#ifndef SOLENOID_H
#define SOLENOID_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

struct solenoid
{
    double ohm, henry, supply_V, diode_V, codes_per_A, zero_code;
    double current, charge, at_s; /* A, A s */
    double held_A;                /* a current that flows whatever the pin says; 0 for none */
    bool on, broken;
};

static inline void solenoid_go_to(struct solenoid *solenoid, double to_s)
{
    const double seconds = to_s - solenoid->at_s, before = solenoid->current;
    const double settled = (solenoid->on ? solenoid->supply_V : -solenoid->diode_V) / solenoid->ohm;
    const double free = settled + (before - settled) * exp(-seconds * solenoid->ohm / solenoid->henry);

    solenoid->current = (solenoid->held_A > 0.0) ? solenoid->held_A : solenoid->broken ? 0.0 : fmax(free, 0.0);
    solenoid->charge += 0.5 * (before + solenoid->current) * seconds;
    solenoid->at_s = to_s;
}

static inline uint16_t solenoid_code(const struct solenoid *solenoid)
{
    return (uint16_t)fmin(fmax(floor(solenoid->zero_code + solenoid->codes_per_A * solenoid->current), 0.0), 4095.0);
}

#endif
