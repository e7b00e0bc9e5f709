/* Compensator and plant, two FMUs in Co-Simulation at the rate of the PWM: each takes what the other gave at the end of
 * the last step. The file named first holds, as doubles: the step's size, supply and pressure behind the edge in MPa, the
 * number of steps, and the command of each, V. Printed: flow, in L/min, as the bits of a double, and the compare value. */
#include <string.h>

#include "fmi_calls.h"

int main(int count, char **arguments)
{
    static const uint32_t pressures[2] = {REF_P_AHEAD, REF_P_BEHIND};
    static const uint32_t supplies[2] = {REF_SUPPLY, REF_BACK_PRESSURE};
    static const uint32_t inputs[3] = {REF_U_I, REF_AHEAD, REF_BEHIND};
    const uint32_t drive = REF_DRIVE, compare = REF_PLANT_COMPARE, flow = REF_Q;
    struct fmu compensator = {0};
    struct fmu plant = {0};
    const double *head, *commands;
    int32_t written = 0;

    begin_results(count, arguments);
    head = read_whole(arguments[1]);
    commands = &head[4];
    double pressure[2] = {head[1], head[2]};

    if (!fmu_instantiate(&compensator, FMU_PATH, FMU_TOKEN, 1) ||
        !fmu_instantiate(&plant, PLANT_PATH, PLANT_TOKEN, 1)) {
        fail("a binary refuses the token of its modelDescription.xml");
    }
    set_reals(&plant, supplies, 2u, pressure);
    fmu_initialize(&compensator);
    fmu_initialize(&plant);
    for (int64_t row = 0; row < (int64_t)head[3]; row++) {
        double given[3] = {commands[row], 0.0, 0.0}, q;
        uint64_t bits;

        get_reals(&plant, pressures, 2u, &given[1]);
        set_ints(&plant, &compare, 1u, &written);
        set_reals(&compensator, inputs, 3u, given);
        step(&compensator, head[0] * (double)row, head[0]);
        step(&plant, head[0] * (double)row, head[0]);
        get_ints(&compensator, &drive, 1u, &written);
        get_reals(&plant, &flow, 1u, &q);
        memcpy(&bits, &q, sizeof bits);
        fprintf(results, "%llu %ld\n", (unsigned long long)bits, (long)written);
    }
    refuses(&plant, head[0] * head[3], head[0], REF_SUPPLY);
    return end_results();
}
