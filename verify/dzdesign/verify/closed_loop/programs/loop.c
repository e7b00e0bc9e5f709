/* The plant, and the compiled core in one loop at the rate of the PWM. */
#include <stddef.h>
#include <stdint.h>

#include "dz_drive.h"
#include "plant_period.h" /* with the header of the current controller, if there is one */

#ifdef DZ_CALIBRATION_WORDS
#include "bound.h" /* behind every header of the core */
#endif

#define RECORDED 9

/* One channel of the converter: code of zero, codes a unit of what it measures, its largest code; and its errors. */
struct channel
{
    double zero;
    double codes;
    double largest;
    double offset; /* codes */
    double gain;   /* 1: none */
    double noise;  /* peak, whole codes */
};

/* errors: offset, codes; gain error, codes at the largest code; peak of the noise, codes. */
static struct channel channel_of(int32_t zero, int32_t full, double span, int32_t code_max, const double *errors)
{
    const double codes = (double)(full - zero);
    const struct channel channel = {(double)zero,
                                    (codes + ((codes > 0.0) ? 1.0 : -1.0)) / span,
                                    (double)code_max,
                                    errors[0],
                                    1.0 + errors[1] / (double)code_max,
                                    errors[2]};

    return channel;
}

/* White noise: whole codes from -peak to peak, each as likely (Marsaglia's xorshift). */
static double white(uint32_t *seed, double peak)
{
    uint32_t next = *seed;

    next ^= next << 13;
    next ^= next >> 17;
    next ^= next << 5;
    *seed = next;
    return (double)(next % (2u * (uint32_t)peak + 1u)) - peak;
}

/* The code of a value: rounded down as converters do, limited to the converter's range. */
static uint16_t convert(const struct channel *channel, double value, uint32_t *seed)
{
    double code = (channel->zero + value * channel->codes) * channel->gain + channel->offset;

    if (channel->noise > 0.0) {
        code += white(seed, channel->noise);
    }
    return (uint16_t)(int32_t)((code < 0.0) ? 0.0 : ((code > channel->largest) ? channel->largest : code));
}

/* What the loop does: the series have n values, each held for `every` periods. */
struct task
{
    int32_t n;
    int32_t every;
    int32_t amplifier; /* 0: the command goes to the PWM as it is */
    int32_t negative;  /* drive solenoid B */
    int32_t ahead;     /* which input the pressure ahead is, 0 for A, and the one behind; the code of any other */
    int32_t behind;
    int32_t other_code;
    int32_t wave;      /* without the amplifier: half the height of a square wave about the command, counts; 0: none */
    int32_t wave_ticks; /* and the periods of half of it */
    int32_t mean;      /* the plant has the drive's dither in it already: it takes the law without it */
    const double *command;    /* share of u_max */
    const double *supply_MPa; /* pressure drop at no flow */
    const double *back_MPa;   /* pressure behind the edge */
    const double *bias_V;     /* drive that is added to the plant's, of another valve or a current's error */
    const int32_t *shown;     /* codes ahead and behind; below zero: of the plant's own pressures */
    uint32_t seed;            /* of the noise, not zero */
    struct channel channels[3]; /* command, pressures ahead and behind */
    const struct coil *coil;    /* what the law's output is the set point of the current in; null: it is the duty */
    const struct sensor *sensor; /* of that current */
};

/* The command with the wave about it, as the ramps were recorded; none at zero command, within the PWM's range. */
static int32_t waved(const struct task *task, int32_t direct, int32_t place, int32_t counts)
{
    const int32_t up = (place % (2 * task->wave_ticks)) < task->wave_ticks;
    const int32_t compare = direct + (up ? task->wave : -task->wave);

    if ((direct == 0) || (task->wave == 0)) {
        return direct;
    }
    return (compare < 0) ? 0 : ((compare > counts) ? counts : compare);
}

/* The codes of the sensors ahead and behind. */
static void read_pressures(const struct task *task, const struct plant *plant, int32_t k, uint32_t *seed, uint16_t *codes)
{
    const double back_MPa = task->back_MPa[k];
    const double ahead_MPa = back_MPa + plant->dp_MPa;

    for (int32_t sensor = 0; sensor < 2; sensor++) {
        const int32_t shown = task->shown[2 * k + sensor];
        const double own_MPa = (sensor == 0) ? ahead_MPa : back_MPa;

        codes[sensor] = (shown < 0) ? convert(&task->channels[1 + sensor], own_MPa, seed) : (uint16_t)shown;
    }
}

/* A new sample, each pressure at its input. */
static void sample(const struct task *task, struct dz_drive *drive, uint16_t u_code, const uint16_t *pressures)
{
    const uint16_t other = (uint16_t)task->other_code;
    uint16_t codes[3] = {other, other, other};

    codes[task->ahead] = pressures[0];
    codes[task->behind] = pressures[1];
#ifdef DZ_STATUS_PRESSURE_C
    dz_drive_sample(drive, u_code, codes[0], codes[1], codes[2]);
#else
    dz_drive_sample(drive, u_code, codes[0], codes[1]);
#endif
}

static inline void run(const struct task *task, struct plant *plant, double *record)
{
    struct dz_drive drive;
    struct coil_run coil;
    uint16_t compare = 0u;
    uint16_t pressures[2] = {0u, 0u};
    int32_t tick = 0;
    uint32_t seed = task->seed;

    dz_drive_init(&drive);
    if (task->coil != NULL) {
        coil_at_rest(&coil, task->coil, task->sensor);
    }
    for (int32_t k = 0; k < task->n; k++) {
        const uint16_t direct = (uint16_t)(int32_t)(task->command[k] * (double)plant->counts + 0.5);
        double sum = 0.0;
        double largest = 0.0;

        plant_supply(plant, task->supply_MPa[k]);
        plant->bias = task->bias_V[k];
        for (int32_t j = 0; j < task->every; j++) {
            const int32_t in_force = (int32_t)compare; /* written in the last period, in force in this one */

            if (task->amplifier) {
                if (tick == 0) {
                    const uint16_t u_code = convert(&task->channels[0], task->command[k], &seed);

                    read_pressures(task, plant, k, &seed, pressures);
                    sample(task, &drive, u_code, pressures);
                    tick = (int32_t)DZ_DRIVE_TICKS_PER_SAMPLE;
                }
                tick--;
                dz_drive_tick(&drive);
                compare = task->negative ? drive.compare_b : drive.compare_a;
                if (task->mean) {
                    compare = (drive.side == (task->negative ? -1 : 1)) ? drive.law : 0u;
                }
            } else {
                compare = (uint16_t)waved(task, direct, k * task->every + j, plant->counts);
            }
            if (task->coil != NULL) {
                const uint16_t set_points[2] = {task->negative ? 0u : compare, task->negative ? compare : 0u};

                coil_period(&coil, set_points);
                plant_period_of_current(plant, coil.means_A[task->negative] / task->coil->rated_A);
            } else {
                plant_period(plant, (in_force < plant->counts) ? in_force : plant->counts);
            }
            sum += plant->flow;
            largest = (plant->flow > largest) ? plant->flow : largest;
        }
        record[RECORDED * k] = (double)compare;
        record[RECORDED * k + 1] = plant->dp_MPa;
        record[RECORDED * k + 2] = plant->flow;
        record[RECORDED * k + 3] = sum / (double)task->every;
        record[RECORDED * k + 4] = largest;
        record[RECORDED * k + 5] = plant->state[POSITION];
        record[RECORDED * k + 6] = (double)pressures[0];
        record[RECORDED * k + 7] = (double)pressures[1];
        record[RECORDED * k + 8] = plant->mean;
    }
}

/* choices: n, every, amplifier, negative, input ahead, behind, code of another, wave, its ticks, mean, largest code, largest compare value, seed.
 * series, channels: see `task`; errors: three numbers a channel, see `channel_of`.
 * p: the plant, see plant.py; curve: its recorded characteristic, see stand_in.py, or null; coil, sensor:
 * of a drive by current, or null.
 * record[n][9]: compare value, dP in MPa, Q in L/min at its end; over the record mean and largest Q; position in m; the
 * last codes ahead and behind; mean current of the last period in V of command. */
void dz_loop(const int32_t *choices, const double *command, const double *supply_MPa, const double *back_MPa,
             const double *bias_V, const int32_t *shown, const int32_t *zeros, const int32_t *fulls,
             const double *spans, const double *errors, const double *p, const double *curve, const struct coil *coil,
             const struct sensor *sensor, double *record)
{
    struct plant plant;
    struct task task = {choices[0], choices[1], choices[2], choices[3], choices[4], choices[5],
                        choices[6], choices[7], choices[8], choices[9], command,    supply_MPa, back_MPa, bias_V,
                        shown,      (uint32_t)choices[12],  {{0.0, 0.0, 0.0, 0.0, 0.0, 0.0}}, coil, sensor};

    for (int index = 0; index < 3; index++) {
        task.channels[index] = channel_of(zeros[index], fulls[index], spans[index], choices[10], &errors[3 * index]);
    }
    plant_at_rest(&plant, p, curve, choices[11], supply_MPa[0]);
    run(&task, &plant, record);
}

/* A piston behind a valve of two solenoids, and a P controller of its position: the command that a firmware gets. */
struct axis
{
    double gain;     /* command, a share of full, for a unit of position */
    double late;     /* samples by which a command is late */
    double kept;     /* of the spool's distance from its aim over a part of a PWM period */
    double moves[2]; /* position over the flow, L/min, of such a part, at positive and negative commands */
};

/* Parts of a PWM period in which spool and piston are advanced. */
#define PARTS 4

/* A new sample. The pressures are those of the side that it drives: a side that is left loses its pressure drop. */
static void sample_of_side(const struct task *tasks, const struct plant *valves, struct dz_drive *drive, double command,
                           uint32_t *seed)
{
    const int of_command = command < 0.0;
    const uint16_t u_code = convert(&tasks[of_command].channels[0], fabs(command), seed);
    struct dz_drive tried = *drive;
    int side = drive->side < 0;
    uint16_t pressures[2];

    read_pressures(&tasks[side], &valves[side], 0, seed, pressures);
    sample(&tasks[side], &tried, u_code, pressures);
    if ((tried.side != 0) && ((tried.side < 0) != side)) {
        side = !side;
        read_pressures(&tasks[side], &valves[side], 0, seed, pressures);
    }
    sample(&tasks[side], drive, u_code, pressures);
}

/* Advance spool, flows and piston by a PWM period; the spool, a share of full, has a lag of first order. */
static double moved(const struct axis *axis, struct plant *valves, double aim, double *spool)
{
    double way = 0.0;

    for (int part = 0; part < PARTS; part++) {
        *spool = aim + (*spool - aim) * axis->kept;
        for (int side = 0; side < 2; side++) {
            const double *curve = valves[side].curve;
            const double open = fmax(side ? -*spool : *spool, 0.0);

            curve_flow(&valves[side], open * curve[CURVE_U_MAX_V] / curve[CURVE_V_PER_M]);
            way += (side ? -1.0 : 1.0) * axis->moves[side] * valves[side].flow;
        }
    }
    return way;
}

/* choices: samples; of zero command before them; counts of full drive, largest code, whether the plant has the dither in
 * it; of positive and of negative commands: input ahead, behind, code of another.
 * numbers: where the piston is let go; `struct axis`; pressure behind the edge, MPa; and at no flow the drop.
 * zeros, fulls, spans: of both signs; p: of any plant; positive, negative: recorded characteristics.
 * position[samples]: of the piston, which is to come to zero. */
void dz_position_loop(const int32_t *choices, const double *numbers, const int32_t *zeros, const int32_t *fulls,
                      const double *spans, const double *p, const double *positive, const double *negative,
                      double *position)
{
    const struct axis axis = {numbers[1], numbers[2], numbers[3], {numbers[4], numbers[5]}};
    const double exact[3] = {0.0, 0.0, 0.0};
    const int32_t shown[2] = {-1, -1};
    const int32_t late = (int32_t)axis.late;
    struct plant valves[2];
    struct task tasks[2] = {{.n = 1}, {.n = 1}};
    struct dz_drive drive;
    double spool = 0.0;
    double aim = 0.0;
    double at = numbers[0];
    uint32_t seed = 1u;

    for (int side = 0; side < 2; side++) {
        struct task *task = &tasks[side];

        task->ahead = choices[5 + 3 * side];
        task->behind = choices[6 + 3 * side];
        task->other_code = choices[7 + 3 * side];
        task->back_MPa = &numbers[6];
        task->shown = shown;
        for (int index = 3 * side; index < 3 * side + 3; index++) {
            task->channels[index - 3 * side] = channel_of(zeros[index], fulls[index], spans[index], choices[3], exact);
        }
        plant_at_rest(&valves[side], p, side ? negative : positive, choices[2], numbers[7]);
    }
    dz_drive_init(&drive);
    for (int32_t k = -choices[1]; k < choices[0]; k++) {
        const double seen = (k < late) ? numbers[0] : position[k - late];
        const double command = (k < 0) ? 0.0 : fmin(fmax(axis.gain * seen, -1.0), 1.0);

        if (k >= 0) {
            position[k] = at;
        }
        sample_of_side(tasks, valves, &drive, command, &seed);
        for (uint32_t tick = 0u; tick < DZ_DRIVE_TICKS_PER_SAMPLE; tick++) {
            const double in_force = aim; /* written in the last period, in force in this one */

            dz_drive_tick(&drive);
            aim = (double)drive.compare_a - (double)drive.compare_b;
            if (choices[4]) {
                aim = (double)drive.side * (double)drive.law;
            }
            aim /= (double)choices[2];
            at -= (k < 0) ? 0.0 : moved(&axis, valves, in_force, &spool);
        }
    }
}

/* The flow of a recorded characteristic at the spool's mean positions, m, in one period after another; n: choices[0]. */
void dz_flows(const int32_t *choices, const double *supply_MPa, const double *position, const double *p,
              const double *curve, double *flow)
{
    struct plant plant;

    plant_at_rest(&plant, p, curve, 1, supply_MPa[0]);
    for (int32_t k = 0; k < choices[0]; k++) {
        plant_supply(&plant, supply_MPa[k]);
        curve_flow(&plant, position[k]);
        flow[k] = plant.flow;
    }
}
