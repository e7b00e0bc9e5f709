/* Runs the generated firmware on the model and prints what happened, one line a fact.
 *
 *   driver calls                  main() up to EINT, every DriverLib call, then the calls of one interrupt
 *   driver run EVENTS [W|C]       the same in silence (after a watchdog reset, or without crystal), then one period an event:
 *                                 . nothing special, x no conversion, h a code above 12 bits, b converter busy,
 *                                 z the command is zero from here, n no longer, T the trip pin goes low, t high,
 *                                 K, k the same for the second trip pin, m codes that make 20000 from here,
 *                                 c the command is in the middle of its codes from here, n no longer, p pressures that a
 *                                 4-20 mA sensor gives from here,
 *                                 B the stand-in core drives solenoid B from here, A solenoid A
 *   driver watchdog               how often the main loop serves the watchdog without and with an interrupt
 */
#include <setjmp.h>
#include <stdio.h>
#include <string.h>

#include "model.h"

#define main firmware_main
#include "main.c"
#undef main

static jmp_buf out_of_main;
static unsigned services;

static void leave(void) { longjmp(out_of_main, 1); }
static void count_service(void) { services++; }

static void start_up(void)
{
    device_on_eint = leave;
    if (setjmp(out_of_main) == 0)
    {
        (void)firmware_main();
    }
}

static void run(const char *events)
{
    for (; *events != '\0'; events++)
    {
        const struct tick tick = device_period(*events);
        printf("tick event=%c output=%s duty=%u served=%u cmpa=%u without=%u released=%u fault=%u duty_b=%u forced=%u forced_b=%u cmpb=%u",
               *events,
               tick.output, (unsigned)tick.duty, tick.served, (unsigned)model.cmpa[0], dz_state.ticks_without_sample,
               dz_state.released, dz_state.fault, (unsigned)tick.duty_b, (unsigned)model.tripped[0], (unsigned)model.tripped[1],
               (unsigned)model.cmpa[1]);
#ifdef DZ_FAULT_CALIBRATION
        printf(" calibration=%u", dz_state.calibration);
#endif
#ifdef DZ_CURRENT_REST_TICKS
        printf(" converted=%u before=%u first=%u apart=%u current=%u sum=%u offset=%u current_faults=%u set_point=%u",
               tick.converted, tick.before, tick.first, tick.apart, tick.current_mA, dz_state.current_sum,
               dz_state.current_offset, dz_state.current_faults, dz_state.set_point);
#endif
        puts("");
    }
}

int main(int count, char **words)
{
    if ((count > 3) && (words[3][0] == 'W'))
    {
        model.reset_by_watchdog = true;
    }
    if ((count > 3) && (words[3][0] == 'C'))
    {
        model.no_crystal = true;
    }
    device_verbose = (count > 1) && (strcmp(words[1], "calls") == 0);
    start_up();
    if (device_verbose)
    {
        puts("interrupt:");
        (void)device_period('.');
        (void)device_period('.');
    }
    else if (count > 2)
    {
        run(words[2]);
    }
    else
    {
        device_on_service = count_service;
        service_watchdog_if_isr_ran();
        printf("%u\n", services);
        (void)device_period('.');
        service_watchdog_if_isr_ran();
        printf("%u\n", services);
    }
    return 0;
}
