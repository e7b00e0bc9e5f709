/* A solenoid and its sensors for the device models: coil of 4 ohm and 40 mH at 24 V with a freewheeling diode of 0.7 V;
 * 2 V at the converter's pin for 1 A and 0.15 V without current; 0.075 V for 1 V of the supply. At first 1 A flows.
 *
 * Events: 'o' the wire breaks; 's' 1.5 A flow, 'v' 1.3 A, whatever the pin says; 'e' the sensor's zero is 0.1 V higher
 * from here on; 'q' no conversion of the current from here on. */
#ifndef SOLENOID_H
#define SOLENOID_H

#include <math.h>
#include <stdint.h>

#define SOLENOID_OHM 4.0
#define SOLENOID_HENRY 0.04
#define SOLENOID_SUPPLY_V 24.0
#define SOLENOID_DIODE_V 0.7

struct solenoid
{
    double current, charge, zero_V, forced; /* A; A s in this period; V; A, 0 for none */
    unsigned broken, stopped;
    unsigned gone_to, duty; /* counts since the period began, and how many of them the pin is high */
};

#define SOLENOID_AT_FIRST {1.0, 0.0, 0.15, 0.0, 0u, 0u, 0u, 0u}

static inline uint16_t code_at(double volts, double full_V)
{
    return (uint16_t)fmin(fmax(floor(volts * 4096.0 / full_V), 0.0), 4095.0);
}

static inline void solenoid_event(struct solenoid *solenoid, char event)
{
    solenoid->broken |= (event == 'o') ? 1u : 0u;
    solenoid->stopped |= (event == 'q') ? 1u : 0u;
    solenoid->forced = (event == 's') ? 1.5 : (event == 'v') ? 1.3 : solenoid->forced;
    solenoid->zero_V = (event == 'e') ? 0.25 : solenoid->zero_V;
}

static inline void solenoid_begin(struct solenoid *solenoid, unsigned duty)
{
    solenoid->duty = duty;
    solenoid->gone_to = 0u;
    solenoid->charge = 0.0;
}

/* On to so many counts after the period began. */
static inline void solenoid_go_to(struct solenoid *solenoid, unsigned counts, double counts_in_s)
{
    while (solenoid->gone_to < counts)
    {
        const int on = solenoid->gone_to < solenoid->duty;
        const unsigned end = (on && (solenoid->duty < counts)) ? solenoid->duty : counts;
        const double seconds = (end - solenoid->gone_to) / counts_in_s;
        const double settled = (on ? SOLENOID_SUPPLY_V : -SOLENOID_DIODE_V) / SOLENOID_OHM;
        const double before = solenoid->current;
        const double free = settled + (before - settled) * exp(-seconds * SOLENOID_OHM / SOLENOID_HENRY);

        solenoid->current = (solenoid->forced > 0.0) ? solenoid->forced : solenoid->broken ? 0.0 : fmax(free, 0.0);
        solenoid->charge += 0.5 * (before + solenoid->current) * seconds;
        solenoid->gone_to = end;
    }
}

static inline double solenoid_volts(const struct solenoid *solenoid)
{
    return solenoid->zero_V + 2.0 * solenoid->current;
}

#endif
