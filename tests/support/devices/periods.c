/* See periods.h. */
#include "periods.h"

#include <math.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>

#include "solenoid.h"

#ifdef F28335
#include "DSP28x_Project.h"
#define FULL_V 3.0
#define CRYSTAL_HZ 30e6
#else
#define FULL_V 3.3
#define CRYSTAL_HZ 20e6
#endif
#define CODES_PER_V (4096.0 / FULL_V)
#define COMMAND 0u
#define CURRENT 3u
#define SUPPLY 4u
#define TRIP_GPIO 12u
#define OVER_CURRENT_GPIO 13u
#define LATE_S 30e-6

int firmware_main(void);

int device_side = 1, device_command = -1;
unsigned device_services, device_line_count;
uint8_t device_line[120000];

static struct solenoid solenoid = {4.0, 0.04, 24.0, 0.7, 2.0 * CODES_PER_V, 0.15 * CODES_PER_V, 1.0, 0.0, 0.0, 0.0, false, false};
static struct tick tick;
static char event;
static bool zero, half, centre, sound, stopped;
static unsigned samples;
static int64_t origin, begins, high_since[2], sampled_at;
static bool high[2];
static jmp_buf out_of_main;

static int64_t period(void) { return (int64_t)pwms[0].active_period + 1; }

/* The n-th sample has the codes 100 n (n modulo 41), 1 and 2; the channels that nobody uses give 4000. */
uint16_t code_at(unsigned channel)
{
    const uint16_t half_b = (uint16_t)((period() / 2 - 1000 - 10 * 900) / 100);
    uint16_t command;

    if ((channel == COMMAND) && (now - sampled_at > period() / 2))
    {
        samples++;
        sampled_at = now;
    }
    command = (uint16_t)(half ? 1000u : zero ? 0u : centre ? 2048u : 100u * (samples % 41u));
    if (channel == CURRENT)
    {
        solenoid_go_to(&solenoid, seconds_now());
        return solenoid_code(&solenoid);
    }
    if (channel == SUPPLY)
    {
        return (uint16_t)(24.0 * 0.075 * CODES_PER_V);
    }
    if (channel > SUPPLY)
    {
        return 4000u;
    }
    if ((channel == COMMAND) && (device_command >= 0))
    {
        return (uint16_t)device_command;
    }
    if (event == 'h')
    {
        return 0xFFFFu;
    }
    if (event == 'f')
    {
        return (uint16_t[]){999u, 900u, 500u}[channel];
    }
    return (uint16_t[]){command, (uint16_t)(half ? 900u : sound ? 2000u : zero ? 0u : 1u),
                        (uint16_t)(half ? half_b : sound ? 800u + command / 2u : zero ? 0u : 2u)}[channel];
}

bool converter_hears(unsigned channel) { return (channel == CURRENT) ? !stopped : (event != 'x'); }

bool processor_takes_interrupts(void) { return true; }

void after_interrupt(void)
{
#ifdef F28335
    tick.acknowledged = PieCtrlRegs.PIEACK.all;
#endif
}

int64_t next_of_program(void) { return NEVER; }

void act(void) {}

/* The main loop does not run in between, so nothing serves it. */
void reset_by_watchdog(void) { watchdog_on = false; }

static void pin_changed(unsigned output, unsigned level)
{
    unsigned *const duty = (output == 0u) ? &tick.duty : &tick.duty_b;

    if (output == 0u)
    {
        solenoid_go_to(&solenoid, seconds_now());
        solenoid.on = level != LOW;
    }
    *duty += high[output] ? (unsigned)(now - high_since[output]) : 0u;
    tick.falls = ((output == 0u) && high[output] && (now > begins)) ? (unsigned)(now - origin) : tick.falls;
    high[output] = level != LOW;
    high_since[output] = now;
}

void happened(const char *what, unsigned one, unsigned two)
{
    const bool is_hold = strcmp(what, "hold") == 0;

    if (strcmp(what, "start") == 0)
    {
        origin = begins = now;
        sampled_at = now - period();
        longjmp(out_of_main, 1);
    }
    if ((strcmp(what, "pin") == 0) && ((one == 0u) || (one == 2u)))
    {
        pin_changed(one / 2u, two);
    }
    else if (strcmp(what, "interrupt") == 0)
    {
        tick.served++;
        tick.before = tick.converted;
    }
    else if (strcmp(what, "sequencer") == 0)
    {
        tick.resets++;
        tick.reset_busy += two;
    }
    else if (is_hold && (one == COMMAND))
    {
        tick.held = (unsigned)(now - origin);
    }
    else if (is_hold && (one == CURRENT))
    {
        tick.first = (tick.converted == 0u) ? (unsigned)(now - begins) : tick.first;
        tick.apart = (tick.converted == 1u) ? (unsigned)(now - begins) - tick.first : tick.apart;
        tick.converted++;
    }
    else if (strcmp(what, "service") == 0)
    {
        device_services++;
    }
    else if ((strcmp(what, "octet") == 0) && (one == 29u) && (device_line_count < sizeof device_line))
    {
        device_line[device_line_count] = (uint8_t)two;
        device_line_count++;
    }
}

void device_power_up(bool after_watchdog, bool without_crystal)
{
    memset(outside, OPEN, sizeof outside);
    outside[TRIP_GPIO] = outside[OVER_CURRENT_GPIO] = HIGH;
    power_up(after_watchdog, without_crystal, CRYSTAL_HZ);
    settle();
}

void device_start(void)
{
    if (setjmp(out_of_main) == 0)
    {
        (void)firmware_main();
    }
    solenoid.at_s = seconds_now();
    solenoid.current = 1.0;
    solenoid.charge = 0.0;
}

static void begin(char what)
{
    memset(&tick, 0, sizeof tick);
    event = what;
    tick.begins = (unsigned)(begins - origin);
    zero = (event == 'z') || (zero && (event != 'n'));
    half = (event == 'm') || (half && (event != 'n'));
    centre = (event == 'c') || (centre && (event != 'n'));
    sound = (event == 'p') || sound;
    stopped = (event == 'q') || stopped;
    device_side = (event == 'B') ? -1 : (event == 'A') ? 1 : device_side;
    outside[TRIP_GPIO] = (event == 'T') ? LOW : (event == 't') ? HIGH : outside[TRIP_GPIO];
    outside[OVER_CURRENT_GPIO] = (event == 'K') ? LOW : (event == 'k') ? HIGH : outside[OVER_CURRENT_GPIO];
    conversion_delay = (event == 'l') ? (int64_t)(LATE_S * sysclk_hz) : (event == 'b') ? period() + period() / 10 : 0;
    solenoid.broken = (event == 'o') || solenoid.broken;
    solenoid.held_A = (event == 's') ? 1.5 : (event == 'v') ? 1.3 : solenoid.held_A;
    solenoid.zero_code += (event == 'e') ? 0.1 * CODES_PER_V : 0.0;
    settle();
    begins = (begins == origin) ? now : begins;
}

struct tick device_period(char what, unsigned parts, void (*turn)(void))
{
    const int64_t end = begins + period();

    begin(what);
    for (unsigned part = 1u; part <= parts; part++)
    {
        run_until(begins + period() * part / parts - 1);
        if (turn != 0)
        {
            turn();
        }
    }
    for (unsigned output = 0u; output < 2u; output++)
    {
        (output == 0u ? &tick.duty : &tick.duty_b)[0] += high[output] ? (unsigned)(end - high_since[output]) : 0u;
        high_since[output] = end;
    }
    solenoid_go_to(&solenoid, seconds_now());
    tick.current_mA = (unsigned)(1000.0 * solenoid.charge * sysclk_hz / (double)period() + 0.5);
    solenoid.charge = 0.0;
    begins = end;
    return tick;
}
