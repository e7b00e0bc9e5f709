/* The generated firmware of block form on the model of the F28335, told by lines of stdin what happens:
 *
 *   linked HEX    the block that the firmware is linked with; before `start`
 *   start         main() until interrupts are on
 *   command N     the code of the command from here on
 *   trip 0|1      the trip input
 *   break         the line is pulled low for long
 *   run N         so many PWM periods, eight turns of the main loop in each; octets that were sent come in between
 *   send HEX      octets for the receiver, five a period at most
 *
 * Each line is answered by one: `key=number` for what is of interest, and `line=HEX`, what was transmitted since. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "DSP28x_Project.h"
#include "dz_drive.h"
#include "periods.h"
#include "serial.h"

#define main firmware_main
#include "main.c"
#undef main

#define TURNS 8u
#define OCTETS_A_PERIOD 5u
#define QUEUE 65536u
#define UNIT 65536 /* of the ramp, in a code */
#define STEP 20    /* codes a sample */

struct dz_calibration dz_block;

static uint8_t queue[QUEUE];
static unsigned queued, wrong_reads, turns;

#ifndef REAL_CORE
/* The drive follows its block's serial number, its ramp can be seen but does nothing, and is never asked while no block may be read. */
static uint16_t read(const struct dz_calibration *block)
{
    wrong_reads += ((block == NULL) || (dz_hold_wanted != 0u)) ? 1u : 0u;
    return (block == NULL) ? 0u : (uint16_t)(10000u + 100u * (block->serial[1] >> 8));
}

void dz_drive_init(const struct dz_calibration *block, struct dz_drive *drive)
{
    (void)read(block);
    memset(drive, 0, sizeof *drive);
}

void dz_drive_sample(const struct dz_calibration *block, struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc,
                     uint16_t p_b_adc)
{
    const int32_t asked = (int32_t)u_adc - (int32_t)block->command_zero;
    const int32_t to_go = asked - drive->ramped / UNIT;

    (void)p_a_adc;
    (void)p_b_adc;
    drive->law = (uint16_t)((labs((long)asked) > block->interlock) ? read(block) : 0u);
    drive->side = (int16_t)((asked < 0) ? -1 : 1);
    drive->ramped += UNIT * ((to_go > STEP) ? STEP : (to_go < -STEP) ? -STEP : to_go);
}

void dz_drive_tick(const struct dz_calibration *block, struct dz_drive *drive)
{
    (void)read(block);
    drive->compare_a = (uint16_t)((drive->side > 0) ? drive->law : 0u);
    drive->compare_b = (uint16_t)((drive->side < 0) ? drive->law : 0u);
}

uint16_t dz_status(const struct dz_calibration *block, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    (void)u_adc;
    (void)p_a_adc;
    (void)p_b_adc;
    return (uint16_t)(block->serial[1] >> 8);
}

uint16_t dz_beta(const struct dz_calibration *block, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return dz_status(block, 0u, p_a_adc, p_b_adc);
}

uint16_t dz_status_negative(const struct dz_calibration *block, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return dz_status(block, u_adc, p_a_adc, p_b_adc);
}

uint16_t dz_beta_negative(const struct dz_calibration *block, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return dz_status(block, 0u, p_a_adc, p_b_adc);
}

#endif

static unsigned take_hex(const char *text, uint8_t *octets, unsigned most)
{
    unsigned count = 0u;
    unsigned octet;

    for (; (count < most) && (sscanf(text, "%2x", &octet) == 1); text += 2)
    {
        octets[count++] = (uint8_t)octet;
    }
    return count;
}

static void turn(void)
{
    if ((queued > 0u) && (turns % TURNS < OCTETS_A_PERIOD))
    {
        serial_receive(0u, queue[0]);
        queued--;
        memmove(queue, queue + 1, queued);
    }
    turns++;
    service_watchdog_if_isr_ran();
    dz_telemetry_poll();
}

static struct tick run(unsigned periods)
{
    struct tick tick;

    memset(&tick, 0, sizeof tick);
    for (unsigned period = 0u; period < periods; period++)
    {
        tick = device_period('.', TURNS, turn);
    }
    return tick;
}

static void answer(const struct tick *tick)
{
    printf("answer duty=%u duty_b=%u released=%u held=%u fault=%u ticks=%u used=%u block=%d queued=%u missed=%u "
           "lost=%u errors=%u services=%u wrong_reads=%u ost=%u dropped=%u line=",
           tick->duty, tick->duty_b, dz_state.released, dz_state.held, dz_state.fault, dz_state.ticks, dz_load.used,
           (dz_active == NULL) ? -1 : (int)(dz_active->serial[1] >> 8), queued, serial_missed, serial_lost,
           dz_telemetry.line_errors, device_services, wrong_reads, EPwm1Regs.TZFLG.bit.OST, dz_telemetry.dropped);
    for (unsigned i = 0u; i < device_line_count; i++)
    {
        printf("%02X", device_line[i]);
    }
    puts("");
    fflush(stdout);
    device_line_count = 0u;
}

int main(void)
{
    static char line[2u * QUEUE];
    struct tick tick;

    memset(&tick, 0, sizeof tick);
    device_power_up(false, false);
    while (fgets(line, sizeof line, stdin) != NULL)
    {
        const char *const rest = (strchr(line, ' ') != NULL) ? strchr(line, ' ') + 1 : line;

        if (strncmp(line, "linked", 6) == 0)
        {
            (void)take_hex(rest, (uint8_t *)&dz_block, sizeof dz_block);
        }
        else if (strncmp(line, "start", 5) == 0)
        {
            device_start();
        }
        else if (strncmp(line, "command", 7) == 0)
        {
            device_command = atoi(rest);
        }
        else if (strncmp(line, "trip", 4) == 0)
        {
            tick = device_period((atoi(rest) != 0) ? 'T' : 't', 1u, NULL);
        }
        else if (strncmp(line, "break", 5) == 0)
        {
            serial_break(0u);
        }
        else if (strncmp(line, "send", 4) == 0)
        {
            queued += take_hex(rest, queue + queued, QUEUE - queued);
        }
        else
        {
            tick = run((unsigned)atoi(rest));
        }
        answer(&tick);
    }
    return 0;
}
