/* The recorded characteristic in place of the edge: flow over command of both branches, between two tests. */
#ifndef PLANT_CURVE_H
#define PLANT_CURVE_H

#include "plant.h"

/* The table, as stand_in.py writes it: a head, then where each test begins. */
enum { CURVE_TESTS, CURVE_U_MAX_V, CURVE_V_PER_M, CURVE_SCALE, CURVE_SAG_STEPS, CURVE_SLOPES, CURVE_STARTS = CURVE_SLOPES + 2 };
/* A test: pressure drop at no flow; largest flow; of rising and falling: the command of the first flow seen, where in
 * the test its commands stand, where its flows, how many; then what is left of the pressure drop over the flow. */
enum { TEST_DP_MPA, TEST_Q_MAX, TEST_BRANCHES, TEST_BRANCH_SIZE = 4, TEST_SAG = TEST_BRANCHES + 2 * TEST_BRANCH_SIZE };
enum { BRANCH_SEEN_V, BRANCH_COMMANDS, BRANCH_FLOWS, BRANCH_POINTS };

/* The first flow seen is off both ends of the command, as shares of full. */
#define LEAST_SEEN 1e-3
#define MOST_SEEN 0.99

static inline const double *curve_test(const double *table, int index)
{
    return &table[(int)table[CURVE_STARTS + index]];
}

/* The straight line between the points of a table about a value; beyond its ends the nearest one's. */
static inline double interpolated(const double *at, const double *values, int count, double where)
{
    int low = 0;
    int high = count - 1;

    if (where <= at[0]) {
        return values[0];
    }
    if (where >= at[high]) {
        return values[high];
    }
    while (high - low > 1) {
        const int middle = (low + high) / 2;

        if (at[middle] <= where) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return values[low] + (values[high] - values[low]) * (where - at[low]) / (at[high] - at[low]);
}

/* Another pressure drop at no flow: the tests on both sides of it, and the largest flow, straight in logarithms; beyond
 * the tests it goes with the root of the pressure drop. */
static inline void curve_supply(struct plant *plant)
{
    const double *table = plant->curve;
    const int last = (int)table[CURVE_TESTS] - 1;
    const double dp = plant->supply_MPa;
    int index = 0;

    while ((index + 1 < last) && (curve_test(table, index + 1)[TEST_DP_MPA] < dp)) {
        index++;
    }
    plant->below = curve_test(table, index);
    plant->above = curve_test(table, (index < last) ? index + 1 : index);
    plant->share_above = 0.0;
    plant->beyond_MPa = dp - fmin(fmax(dp, plant->below[TEST_DP_MPA]), plant->above[TEST_DP_MPA]);
    if (plant->above != plant->below) {
        const double low = plant->below[TEST_DP_MPA];
        const double high = plant->above[TEST_DP_MPA];

        plant->share_above = fmin(fmax((dp - low) / (high - low), 0.0), 1.0);
        plant->q_max = plant->below[TEST_Q_MAX] * pow(plant->above[TEST_Q_MAX] / plant->below[TEST_Q_MAX],
                                                       log(fmin(fmax(dp, low), high) / low) / log(high / low));
        plant->q_max *= sqrt(dp / fmin(fmax(dp, low), high));
    } else {
        plant->q_max = plant->below[TEST_Q_MAX] * sqrt(dp / plant->below[TEST_DP_MPA]);
    }
    plant->q_max *= table[CURVE_SCALE];
}

/* The share of the largest flow that a branch (0 rising, 1 falling) of the tests passes at a command: the command counts
 * from the first flow seen, whose command runs straight over the pressure drop, and straight on beyond the tests, as a
 * share of what is left on its side. */
static inline double curve_share(const struct plant *plant, int branch, double u)
{
    const double u_max = plant->curve[CURVE_U_MAX_V];
    const double *below = &plant->below[TEST_BRANCHES + TEST_BRANCH_SIZE * branch];
    const double *above = &plant->above[TEST_BRANCHES + TEST_BRANCH_SIZE * branch];
    const double w = plant->share_above;
    const double straight = below[BRANCH_SEEN_V] + w * (above[BRANCH_SEEN_V] - below[BRANCH_SEEN_V]) +
                            plant->beyond_MPa * plant->curve[CURVE_SLOPES + branch];
    const double seen = fmin(fmax(straight, LEAST_SEEN * u_max), MOST_SEEN * u_max);
    const double beyond = (u > seen) ? (u - seen) / (u_max - seen) : (u - seen) / seen;
    double share = 0.0;

    for (int side = 0; side < 2; side++) {
        const double *test = side ? plant->above : plant->below;
        const double *entry = side ? above : below;
        const double room = (beyond > 0.0) ? u_max - entry[BRANCH_SEEN_V] : entry[BRANCH_SEEN_V];
        const double weight = side ? w : 1.0 - w;

        if (weight > 0.0) {
            share += weight * interpolated(&test[(int)entry[BRANCH_COMMANDS]], &test[(int)entry[BRANCH_FLOWS]],
                                           (int)entry[BRANCH_POINTS], entry[BRANCH_SEEN_V] + beyond * room);
        }
    }
    return share;
}

/* Flow and pressure drop of the share of the largest flow that passes. */
static inline void curve_passes(struct plant *plant)
{
    const int steps = (int)plant->curve[CURVE_SAG_STEPS];
    double left = 0.0;

    for (int side = 0; side < 2; side++) {
        const double *sag = &(side ? plant->above : plant->below)[TEST_SAG];
        const double at = fmin(plant->share, 1.0) * (double)steps;
        const int step = (at < (double)steps) ? (int)at : steps - 1;

        left += (side ? plant->share_above : 1.0 - plant->share_above) *
                (sag[step] + (sag[step + 1] - sag[step]) * (at - (double)step));
    }
    plant->flow = plant->share * plant->q_max;
    plant->dp_MPa = plant->supply_MPa * left;
}

/* The same at the spool's mean position over a period: between the branches the spool stands still. */
static inline void curve_flow(struct plant *plant, double x)
{
    const double u = x * plant->curve[CURVE_V_PER_M];
    const double opening = curve_share(plant, 0, u);
    const double closing = curve_share(plant, 1, u);

    plant->share = (plant->share > closing) ? closing : plant->share;
    plant->share = (plant->share < opening) ? opening : plant->share;
    curve_passes(plant);
}

#endif
