/* A coil in a loop with the current controller. */
#ifndef COIL_LOOP_H
#define COIL_LOOP_H

#include <stdint.h>

#include "coil.h"

struct trace
{
    double means_A[2]; /* over the period, of solenoids A and B */
    double both_A;    /* in both at once */
    uint16_t compare;
    uint16_t sum;     /* what the interrupt in it was given */
    uint16_t faults;  /* after it */
    uint16_t unused;
};

/* Runs `count` periods from no current, calibrated, with two set points each; from each of the periods `changes` on with
 * another coil. */
void coil_loop(const struct coil *coils, const uint32_t *changes, uint32_t coil_count, const struct sensor *sensor,
               const uint16_t *set_points, uint32_t count, struct trace *traces);

#endif
