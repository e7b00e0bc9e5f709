/* A coil in a loop with the current controller; coils may follow one another, as wires break. */
#include "coil_loop.h"

void coil_loop(const struct coil *coils, const uint32_t *changes, uint32_t coil_count, const struct sensor *sensor,
               const uint16_t *set_points, uint32_t count, struct trace *traces)
{
    struct coil_run run;
    uint32_t next = 1u;

    coil_at_rest(&run, &coils[0], sensor);
    for (uint32_t k = 0u; k < count; k++) {
        if ((next < coil_count) && (k >= changes[next])) {
            coil_becomes(&run, &coils[next]);
            next++;
        }
        traces[k].compare = (uint16_t)run.loop.compare;
        coil_period(&run, &set_points[2u * k]);
        traces[k].means_A[0] = run.means_A[0];
        traces[k].means_A[1] = run.means_A[1];
        traces[k].both_A = run.both_A;
        traces[k].sum = run.sum;
        traces[k].faults = (uint16_t)run.loop.faults;
    }
}
