/* The firmware on the model of its device, PWM period by PWM period: an event for each, and what happened in it. Times are
 * counts of SYSCLKOUT since the first period began; 0 stands for none.
 *
 * Events: '.' none; 'x' no conversion; 'l' conversion still busy at the interrupt; 'b' busy until the one after it; 'h' codes
 * above 12 bits; 'T' / 't' trip input low / high, 'K' / 'k' the second one; 'B' / 'A' the stand-in core drives solenoid B / A
 * from here; 'f' codes that make one count less than the period of it; from here on: 'm' codes that make half of the
 * period, 'z' codes 0, 'c' the command in the middle, 'n' none of these, 'p' pressures that a 4-20 mA sensor gives. Of the
 * solenoid: 'o' its wire breaks, 's' 1.5 A flow, 'v' 1.3 A, whatever the pin says, 'e' its sensor's zero is 0.1 V higher
 * from here on, 'q' no conversion of the current from here on. */
#ifndef PERIODS_H
#define PERIODS_H

#include <stdint.h>

#include "engine.h"

struct tick
{
    unsigned duty, duty_b; /* counts high in the period */
    unsigned served;       /* interrupts */
    unsigned resets, reset_busy; /* of the sequencer, and while it ran */
    unsigned acknowledged; /* PIEACK as written */
    unsigned held;         /* when the command's sample was held, if one was taken */
    unsigned begins;       /* when the period began */
    unsigned falls;        /* when the pin fell in it, if it did */
    unsigned converted;    /* codes of the current */
    unsigned before;       /* of them, those before the interrupt */
    unsigned first;        /* when the first of them was held, since the period began */
    unsigned apart;        /* from the first to the second */
    unsigned current_mA;   /* mean current of the solenoid */
};

extern int device_side;    /* which solenoid the stand-in core drives */
extern int device_command; /* code of the command; below zero it is that of the event */
extern unsigned device_services;
extern uint8_t device_line[120000]; /* octets that have left GPIO29 */
extern unsigned device_line_count;

void device_power_up(bool after_watchdog, bool without_crystal);
/* main() until interrupts are on, and back to where it was called. */
void device_start(void);
/* The rest of a period, in so many parts, with something to do after each. */
struct tick device_period(char event, unsigned parts, void (*turn)(void));

#endif
