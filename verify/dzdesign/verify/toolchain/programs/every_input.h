/* What Python prepares for every_input.c and what it gives back; the same bytes on every machine. */
#ifndef EVERY_INPUT_H
#define EVERY_INPUT_H

#include <stdint.h>

/* AVR holds tables in program memory. */
#ifdef __AVR__
#define DZ_TABLE __flash
#else
#define DZ_TABLE
#endif

#define DZ_MAX_PARTS 8
#define DZ_MAX_TURNS 6
/* Sampled commands of a row. */
#define DZ_MAX_PLACES 256

/* At the start of what Python prepares; the tables follow where it says, in bytes from its own start.
 * Places number the commands from the first code on, towards full command: `first_code + k * code_step`. */
struct dz_plan {
    int64_t denominator[DZ_MAX_PARTS]; /* of the remainders of each part */
    int32_t part_end[DZ_MAX_PARTS];    /* place behind each part's last */
    int32_t parts;
    int32_t codes; /* of the converter; places 0 to codes - 1 */
    int32_t first_code, code_step;
    int32_t sound_from, sound_to; /* places of sound commands: from the first to behind the last */
    int32_t zero_place, zero_code;
    int32_t compare_limit;
    int32_t a_low, a_high, b_low, b_high; /* sound codes of the pressures, a ahead and b behind */
    int32_t reverse;                      /* the difference is a - slant[b]; below minus this it can't be right */
    int32_t lowest;                       /* difference of the first row */
    int32_t safe_law;                     /* the law where the pressures can't be right, and its value at zero command */
    int32_t safe_at_zero;
    int32_t rows, pairs, places; /* how many; no places: all */
    int32_t stride;              /* of codes of 16 bits */
    int32_t cube;                /* 1: every pair of pressures at zero command too */
    int32_t impatient;           /* 1: the first row with a fault is the last */
    int32_t laws_at, rows_at, directions_at, slant_at, pairs_at, places_at, betas_at;
    int32_t tested_to; /* largest difference of the tests: above it the status says so */
    /* Of the drive: its dither, two sides, the codes by which a command leaves zero, a ramp's code, and the status of a
     * difference that can't be right. */
    int32_t dither_counts, dither_ticks, both, leave_zero, ramp_unit, failed_status;
    /* Which input each pressure is, 0 for A, and its bit of the status; the other one is no pressure of this side. */
    int32_t ahead_input, behind_input, other_input, ahead_bit, behind_bit, other_bit, unused;
};

/* A part of the law, straight in the command: counts (and a half) at its first place, and what a place adds. */
struct dz_part {
    int64_t remainder, carry;
    int32_t quotient, step;
};

/* A difference of pressure codes: pairs (offset + slant[b], b) for `pairs` codes b from b_low on make it. */
struct dz_row {
    int32_t offset;
    uint16_t b_low, pairs; /* no pairs: sound codes can't make it */
    uint16_t first;        /* the pair that the first command is tried with; the next command has the next */
    uint16_t law;
};

/* Which way the law goes from the row before to this one: up to each place its sign, 0 where nothing is asked. */
struct dz_direction {
    int32_t until[DZ_MAX_TURNS];
    int16_t sign[DZ_MAX_TURNS];
};

/* A pair of pressure codes to be tried with every command, the impossible ones too. */
struct dz_pair {
    uint16_t a, b;
    uint16_t sound; /* both are: then commands that are not sound alone are tried */
};

struct dz_findings {
    uint64_t hash; /* of all compare values, in their order */
    uint32_t inputs, wrong, largest_error, out_of_range, falls, against, odd, bad_fallbacks, bad_status, bad_betas, calls;
    int32_t first_row, first_place; /* of the first wrong value */
    int32_t first_found, first_expected, unused; /* equal: what the drive makes of it is wrong, or dz_comp() */
};

/* All inputs. `work` holds three rows of codes, `at_zero` takes what the core gives at zero command for each row. */
void dz_check_everything(const uint8_t *prepared, uint16_t *work, uint16_t *at_zero, struct dz_findings *findings);

/* The places and rows that were prepared, for a machine that is slow and small. */
void dz_check_sample(const uint8_t DZ_TABLE *prepared, struct dz_findings *findings);

/* Of both, in other_codes.c. */
void dz_check_fallbacks(const struct dz_plan *plan, const uint8_t DZ_TABLE *prepared, struct dz_findings *findings);
void dz_check_status(const struct dz_plan *plan, const int32_t DZ_TABLE *slant, struct dz_findings *findings);
void dz_check_betas(const struct dz_plan *plan, const uint8_t DZ_TABLE *prepared, struct dz_findings *findings);

/* Every number found, as text: the hash in two halves, then the counts. */
void dz_put_findings(const struct dz_findings *findings, void (*put)(uint32_t number));

#endif
