/* State of the model in device.c, for the driver. */
#ifndef MODEL_H
#define MODEL_H

#include <stdbool.h>
#include <stdint.h>

struct model
{
    uint32_t period, mode, cmpa[2], cmpb, force[2], at_zero[2], at_cmpa[2], soca_prescale, interrupt_source;
    uint32_t trip_action[2], trip_signals[2], last_conversion[2], powered_us, periods, samples;
    uint32_t channel[16], trigger[16];
    uint16_t result[16];
    /* The counter of ePWM2, and what it starts. */
    uint32_t trigger_period, trigger_prescale, trigger_source, burst_trigger, burst_size, sync_out, xbar[2];
    bool in_phase, at_once, trigger_soca, burst, priority;
    bool soca, converter, interrupt, interrupt_flag, pie, pie_blocked, tripped[2], trip_pin_low[2], adc_flag[2], adc_overflow;
    bool adc_busy, zero, half, centre, sound, reset_by_watchdog, no_crystal;
    void (*isr)(void);
};

struct tick
{
    const char *output; /* low, high, full (a missed compare event) or pwm */
    uint32_t duty;
    uint32_t duty_b;
    unsigned served;
    /* Codes of the current, those before the interrupt, when the first was held, time to the next; mean current. */
    unsigned converted, before, first, apart, current_mA;
};

extern int device_side; /* which solenoid the stand-in core drives */
extern struct model model;
extern int device_verbose;
extern void (*device_on_eint)(void);
extern void (*device_on_service)(void);

struct tick device_period(char event);

#endif
