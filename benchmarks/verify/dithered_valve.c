/* A valve with friction and magnetic hysteresis under an actual dither, in time; shares no code with the product.
 *
 * Everything counts in volts of drive. The coil lags by first order; the magnetic force is a sum of plays of the
 * current (Prandtl and Ishlinskii); the spool is a mass on a spring with a friction that first gives way elastically,
 * then slips (Jenkin); stops at both ends; a notch at the edge; a supply that sags with the flow.
 */
#include <math.h>
#include <stdint.h>

#ifdef WITH_DRIVE
#include "dz_drive.h"
#endif

#define PERIOD_S 400e-6
#define STEPS 4
#define PLAYS 8

/* Numbers of a valve, in the order of dithered_valve.py. */
enum {
    COIL_S, OMEGA, DAMPING, FRICTION_V, STIFFNESS, EDGE_V, FALL_V_MPA, GAIN, NOTCH_V, STROKE_V, SAG, DIRECT, WEIGHTS,
    RADII = WEIGHTS + PLAYS, NUMBERS = RADII + PLAYS
};

struct valve
{
    const double *p;
    double current, position, speed, slip;
    double plays[PLAYS];
    double dp_MPa, flow;
};

static void move(struct valve *valve, double drive_V, double supply_MPa)
{
    const double *p = valve->p;
    const double h = PERIOD_S / STEPS;

    for (int step = 0; step < STEPS; step++) {
        double force, held;

        valve->current = drive_V + (valve->current - drive_V) * exp(-h / p[COIL_S]);
        force = p[DIRECT] * valve->current;
        for (int i = 0; i < PLAYS; i++) {
            valve->plays[i] = fmin(fmax(valve->plays[i], valve->current - p[RADII + i]), valve->current + p[RADII + i]);
            force += p[WEIGHTS + i] * valve->plays[i];
        }
        held = p[STIFFNESS] * (valve->position - valve->slip);
        if (fabs(held) > p[FRICTION_V]) {
            held = copysign(p[FRICTION_V], held);
            valve->slip = valve->position - held / p[STIFFNESS];
        }
        force += p[FALL_V_MPA] * valve->dp_MPa - valve->position - held;
        valve->speed += h * (p[OMEGA] * p[OMEGA] * force - 2.0 * p[DAMPING] * p[OMEGA] * valve->speed);
        valve->position += h * valve->speed;
        if ((valve->position < 0.0) || (valve->position > p[STROKE_V])) {
            valve->position = fmin(fmax(valve->position, 0.0), p[STROKE_V]);
            valve->speed = 0.0;
        }
    }
    {
        const double open = fmax(valve->position - p[EDGE_V], 0.0);
        const double area = p[GAIN] * (sqrt(open * open + p[NOTCH_V] * p[NOTCH_V]) - p[NOTCH_V]);

        valve->dp_MPa = supply_MPa / (1.0 + p[SAG] * area * area);
        valve->flow = area * sqrt(valve->dp_MPa);
    }
}

static struct valve at_rest(const double *p, double supply_MPa)
{
    struct valve valve = {p, 0.0, 0.0, 0.0, 0.0, {0.0}, supply_MPa, 0.0};

    return valve;
}

/* Flow (mean over a record, L/min), its largest, and pressure drop (MPa) of n records of so many periods; the command
 * in V is held for a record, and a square wave of half height peak_V about it; above full drive it is cut. */
void recorded(const double *p, int32_t n, int32_t every, const double *command_V, double supply_MPa, double full_V,
              double peak_V, double frequency_Hz, double *out)
{
    struct valve valve = at_rest(p, supply_MPa);
    double time = 0.0;

    for (int32_t k = 0; k < n; k++) {
        double sum = 0.0, largest = 0.0;

        for (int32_t j = 0; j < every; j++) {
            const double phase = time * frequency_Hz;
            const double wave = (phase - floor(phase) < 0.5) ? peak_V : -peak_V;
            const double drive = (command_V[k] > 0.0) ? command_V[k] + wave : 0.0;

            move(&valve, fmin(fmax(drive, 0.0), full_V), supply_MPa);
            sum += valve.flow;
            largest = fmax(largest, valve.flow);
            time += PERIOD_S;
        }
        out[3 * k] = sum / every;
        out[3 * k + 1] = largest;
        out[3 * k + 2] = valve.dp_MPa;
    }
}

#ifdef WITH_DRIVE
/* The same with the firmware's drive on it: command codes in; a fourth number is the law's compare value. */
void driven(const double *p, int32_t n, int32_t every, const uint16_t *codes, double supply_MPa, double full_V,
            double counts, double back_MPa, double zero_code, double codes_a_MPa, double *out)
{
    struct valve valve = at_rest(p, supply_MPa);
    struct dz_drive drive;
    int32_t tick = 0;

    dz_drive_init(&drive);
    for (int32_t k = 0; k < n; k++) {
        double sum = 0.0, largest = 0.0;

        for (int32_t j = 0; j < every; j++) {
            if (tick == 0) {
                dz_drive_sample(&drive, codes[k],
                                (uint16_t)(zero_code + (valve.dp_MPa + back_MPa) * codes_a_MPa),
                                (uint16_t)(zero_code + back_MPa * codes_a_MPa));
                tick = (int32_t)DZ_DRIVE_TICKS_PER_SAMPLE;
            }
            tick--;
            dz_drive_tick(&drive);
            move(&valve, full_V * drive.compare_a / counts, supply_MPa);
            sum += valve.flow;
            largest = fmax(largest, valve.flow);
        }
        out[4 * k] = sum / every;
        out[4 * k + 1] = largest;
        out[4 * k + 2] = valve.dp_MPa;
        out[4 * k + 3] = drive.law;
    }
}
#endif
