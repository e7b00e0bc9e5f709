/* State of the model in device.c, for the driver. */
#ifndef MODEL_H
#define MODEL_H

#include <stdbool.h>
#include <stdint.h>

struct model
{
    uint32_t period, mode, cmpa[2], cmpb, force[2], at_zero[2], at_cmpa[2], soca_prescale, interrupt_source;
    uint32_t trip_action[2], trip_signals[2], last_conversion, powered_us, periods, samples;
    uint32_t channel[3];
    uint16_t result[3];
    bool soca, converter, interrupt, interrupt_flag, pie, pie_blocked, tripped[2], trip_pin_low, adc_flag, adc_overflow;
    bool adc_busy, zero, reset_by_watchdog, no_crystal;
    void (*isr)(void);
};

struct tick
{
    const char *output; /* low, high, full (a missed compare event) or pwm */
    uint32_t duty;
    uint32_t duty_b;
    unsigned served;
};

extern int device_side; /* which solenoid the stand-in core drives */
extern struct model model;
extern int device_verbose;
extern void (*device_on_eint)(void);
extern void (*device_on_service)(void);

struct tick device_period(char event);

#endif
