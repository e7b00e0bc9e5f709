/* The part of the F28335 around the registers: EALLOW, write-1 bits, ADC sequencer, PWM pin, interrupt path, SCI-A.
 * Times are counts of SYSCLKOUT since the first period began; 0 stands for none. */
#ifndef DEVICE_H
#define DEVICE_H

#include <stdint.h>

struct tick
{
    const char *output; /* during the period: "low", "high" or "pwm" */
    unsigned duty;      /* counts high in the period */
    unsigned served;    /* 1 if the interrupt was taken */
    unsigned reset_busy; /* 1 if RST_SEQ1 was written during a running sequence */
    unsigned resets;    /* RST_SEQ1 writes */
    unsigned acknowledged; /* PIEACK as written */
    unsigned held;      /* when the command's sample was held, if one was taken */
    unsigned begins;    /* when the period began */
    unsigned falls;     /* when the pin fell in it, if it did */
    unsigned duty_b;    /* counts high of the second output */
    unsigned converted; /* codes of the current */
    unsigned before;    /* of them, those before the interrupt */
    unsigned first;     /* when the first of them was held, since the period began */
    unsigned apart;     /* from the first to the second */
    unsigned current_mA; /* mean current of the solenoid */
};

extern void (*device_on_eint)(void);
extern void (*device_on_service)(void);

/* Octets that have left the transmitter, with the count of those that found its FIFO full, or SCI-A not ready. */
#define DEVICE_LINE_OCTETS 120000u
extern uint8_t device_line[DEVICE_LINE_OCTETS];
extern unsigned device_line_count, device_line_lost;
extern unsigned device_line_blocked; /* 1: the transmitter stands still */

/* SCI-A's other direction: an octet comes, or the line is pulled low for long. Octets that found the FIFO full, or the
 * receiver not ready, are counted. */
void device_receive(uint8_t octet);
void device_break(void);
extern unsigned device_octets_missed;

/* The code of the command; below zero it is that of the event. */
extern int device_command;

/* Calls of the stand-in drive since it was at rest. */
extern int device_side;
extern unsigned device_drive_samples, device_drive_ticks;

void device_power_up(void);
/* All registers of ePWM and ADC as another program may have left them, before this one starts. */
void device_leave_behind(uint16_t value);

/* The solenoid and the conversions of its current, in current.c: the pin is high for `duty` counts of the period, the
 * interrupt comes at `at`. Both halves of a period, before the interrupt and from it on; 1 if a conversion runs then. */
void device_current_event(char event);
int device_current_before(struct tick *tick, unsigned duty, unsigned at);
void device_current_after(struct tick *tick);
uint16_t device_supply_code(void);
/* Counts from a start of conversion until its sample is held, and to its result. */
unsigned device_counts_to_hold(void);
unsigned device_counts_to_result(void);
/* SCI-A after so many counts more. */
void device_transmit(unsigned counts);
void device_settle(void);
struct tick device_period(char event);

#endif
