/* Runs the firmware's main() on the model of its device, and prints what happens outside: a line each, with the counts of
 * SYSCLKOUT since the clock was set, a word and two numbers.
 *
 *   scenario CRYSTAL_HZ WATCHDOG NO_CRYSTAL END_US {TIME_US WORD ONE TWO}...
 *
 * What happens from a time on, counted from where interrupts are enabled, or -1 before the start:
 * code CHANNEL CODE     what a channel converts to             wire GPIO LEVEL     0 low, 1 high, 2 open
 * converter ON CHANNEL  whether its starts are heard          interrupts ON 0     whether the processor takes them
 * halt 0 0              by a debugger                         clock 0 0           stands still
 * octet VALUE GPIO      comes on a serial line
 * compare A B           written after each interrupt           coil CHANNEL GPIO   a solenoid and its sensor; of two
 * solenoids one each, perhaps with one sensor; all with sensor CODES_PER_A ZERO_CODE, winding OHM HENRY and supply V
 * DIODE_V; flows A 0     a current in the first one (at the start)
 *
 * Where the pin of a solenoid goes high, what flows in the other one is printed: held GPIO and 0.1 mA.
 *
 * Each function of main.c that is entered is a turn of the main loop: it takes TURN_S. */
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dz_comp.h"
#include "dz_hardware.h"
#include "dz_isr.h"
#include "engine.h"
#include "solenoid.h"

#define TURN_S 37e-6

struct step
{
    double at_s;
    const char *word;
    double one, two;
};

int firmware_main(void);
void __cyg_profile_func_enter(void *function, void *caller);
void __cyg_profile_func_exit(void *function, void *caller);

static struct step *steps;
static unsigned step_count, step_at;
static double started_s, end_s;
static bool started, writes, interrupts_off, hangs, deaf[CHANNELS];
static uint16_t codes[CHANNELS], compares[2];
static unsigned coils, coil_channel[2], coil_gpio[2];
static struct solenoid solenoids[2];
static jmp_buf out;

/* What the firmware says is wrong, when that changes. */
static void tell_faults(void)
{
    static unsigned told;

    if (dz_state.fault != told)
    {
        told = dz_state.fault;
        happened("fault", told, 0u);
    }
}

void happened(const char *what, unsigned one, unsigned two)
{
    for (unsigned coil = 0u; (strcmp(what, "pin") == 0) && (coil < coils); coil++)
    {
        solenoid_go_to(&solenoids[coil], seconds_now());
        if (one == coil_gpio[coil])
        {
            solenoids[coil].on = two == HIGH;
        }
        else if (two == HIGH)
        {
            printf("%lld held %u %u\n", (long long)now, coil_gpio[coil], (unsigned)(1e4 * solenoids[coil].current));
        }
    }
    if (strcmp(what, "start") == 0)
    {
        started = true;
        started_s = seconds_now();
    }
    printf("%lld %s %u %u\n", (long long)now, what, one, two);
    if (strcmp(what, "start") == 0)
    {
        tell_faults();
    }
}

uint16_t code_at(unsigned channel)
{
    struct solenoid sensed = solenoids[0];
    bool is_sensor = false;

    sensed.current = 0.0;
    for (unsigned coil = 0u; coil < coils; coil++)
    {
        solenoid_go_to(&solenoids[coil], seconds_now());
        if (channel == coil_channel[coil])
        {
            sensed.current += solenoids[coil].current;
            is_sensor = true;
        }
    }
    return is_sensor ? solenoid_code(&sensed) : codes[channel];
}

bool converter_hears(unsigned channel) { return !deaf[channel]; }

bool processor_takes_interrupts(void) { return !interrupts_off; }

void after_interrupt(void)
{
    tell_faults();
    if (writes)
    {
        dz_write_compare_a(compares[0]);
#ifdef TWO_SOLENOIDS
        dz_write_compare_b(compares[1]);
#endif
    }
}

int64_t next_of_program(void)
{
    return ((step_at < step_count) && (started || (steps[step_at].at_s < 0.0))) ? counts_at(started_s + steps[step_at].at_s) : NEVER;
}

void act(void)
{
    const struct step *const step = &steps[step_at];
    const unsigned one = (unsigned)step->one, two = (unsigned)step->two;

    step_at++;
    if (strcmp(step->word, "code") == 0)
    {
        codes[one] = (uint16_t)two;
    }
    else if (strcmp(step->word, "wire") == 0)
    {
        outside[one] = (uint8_t)two;
    }
    else if (strcmp(step->word, "converter") == 0)
    {
        deaf[two] = one == 0u;
    }
    else if (strcmp(step->word, "interrupts") == 0)
    {
        interrupts_off = one == 0u;
    }
    else if (strcmp(step->word, "halt") == 0)
    {
        halted = interrupts_off = hangs = true;
    }
    else if (strcmp(step->word, "clock") == 0)
    {
        clock_lost = true;
    }
    else if (strcmp(step->word, "octet") == 0)
    {
        receive(two, (uint8_t)one);
    }
    else if (strcmp(step->word, "turns") == 0)
    {
        hangs = one == 0u;
    }
    else if (strcmp(step->word, "compare") == 0)
    {
        writes = true;
        compares[0] = (uint16_t)one;
        compares[1] = (uint16_t)two;
    }
    else if (strcmp(step->word, "coil") == 0)
    {
        coil_channel[coils] = one;
        coil_gpio[coils] = two;
        coils++;
    }
    else if (strcmp(step->word, "sensor") == 0)
    {
        solenoids[0].codes_per_A = step->one;
        solenoids[0].zero_code = step->two;
    }
    else if (strcmp(step->word, "winding") == 0)
    {
        solenoids[0].ohm = solenoids[1].ohm = step->one;
        solenoids[0].henry = solenoids[1].henry = step->two;
    }
    else if (strcmp(step->word, "supply") == 0)
    {
        solenoids[0].supply_V = solenoids[1].supply_V = step->one;
        solenoids[0].diode_V = solenoids[1].diode_V = step->two;
    }
    else
    {
        solenoids[0].current = step->one;
    }
}

void reset_by_watchdog(void)
{
    happened("reset", 0u, 0u);
    longjmp(out, 1);
}

void __cyg_profile_func_enter(void *function, void *caller)
{
    (void)function, (void)caller;
    while (started)
    {
        delay(TURN_S);
        if (seconds_now() > started_s + end_s)
        {
            happened("end", 0u, 0u);
            longjmp(out, 1);
        }
        if (!hangs)
        {
            return;
        }
    }
}

void __cyg_profile_func_exit(void *function, void *caller) { (void)function, (void)caller; }

int main(int count, char **words)
{
    step_count = (unsigned)(count - 5) / 4u;
    steps = calloc(step_count + 1u, sizeof *steps);
    for (unsigned each = 0u; each < step_count; each++)
    {
        char **const step = words + 5u + 4u * each;
        steps[each] = (struct step){1e-6 * strtod(step[0], NULL), step[1], strtod(step[2], NULL), strtod(step[3], NULL)};
    }
    end_s = 1e-6 * strtod(words[4], NULL);
    memset(outside, OPEN, sizeof outside);
    while ((step_at < step_count) && (steps[step_at].at_s < 0.0))
    {
        act();
    }
    if (setjmp(out) == 0)
    {
        power_up(words[2][0] == '1', words[3][0] == '1', strtod(words[1], NULL));
        settle();
        (void)firmware_main();
    }
    return fflush(stdout);
}
