/* The drive on this machine beside its model: samples and what the model says after every tick come from a file; how
 * many ticks, how many of them wrong, and the first wrong one with its field go to stdout. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dz_drive.h"

#ifdef DZ_CALIBRATION_WORDS
#include "bound.h"
#endif

#define FIELDS 14

static long wrong_field(const struct dz_drive *drive, const int32_t *expected)
{
    const int32_t found[FIELDS] = {drive->compare_a, drive->compare_b, drive->status, drive->law,
                                   drive->side,      drive->ticks,     drive->at_rest,
                                   drive->rising,    drive->played,    drive->ramped,
                                   drive->valid_commands,  drive->valid_pressures,
                                   drive->faulty_commands, drive->faulty_pressures};

    for (long field = 0; field < FIELDS; field++) {
        if (found[field] != expected[field]) {
            return field;
        }
    }
    return -1;
}

struct comparison {
    long ticks, wrong, first, first_field;
};

/* The state against the next one of the file: 0 where there is none. */
static int compare(const struct dz_drive *drive, FILE *file, struct comparison *found)
{
    int32_t expected[FIELDS];
    long field;

    if (fread(expected, sizeof expected, 1, file) != 1) {
        return 0;
    }
    field = wrong_field(drive, expected);
    if (field >= 0 && found->wrong++ == 0) {
        found->first = found->ticks;
        found->first_field = field;
    }
    return 1;
}

static int run(FILE *file)
{
    int32_t head[2];
    struct comparison found = {0, 0, 0, 0};
    int whole = 1;
    uint16_t *codes;
    /* Where the ramp is put before each sample, side and rest, and what is remembered of faults, two in a word. */
    int32_t *places, *words, *sound, *faulty;
    struct dz_drive drive;

    if (fread(head, sizeof head, 1, file) != 1 || head[0] < 1) {
        return 2;
    }
    codes = malloc((size_t)head[0] * 6u + 2u);
    places = malloc(4u * (size_t)head[0] * sizeof *places);
    words = places + head[0];
    sound = words + head[0];
    faulty = sound + head[0];
    /* The codes fill whole words. */
    if (codes == NULL || places == NULL || fread(codes, ((size_t)head[0] * 6u + 3u) & ~(size_t)3u, 1, file) != 1 ||
        fread(places, 4u * (size_t)head[0] * sizeof *places, 1, file) != 1) {
        free(codes);
        free(places);
        return 2;
    }
    memset(&drive, 0xA5, sizeof drive);
    dz_drive_init(&drive);
    whole = compare(&drive, file, &found);
    /* PWM periods before the first sample, then those of each sample. */
    for (int32_t sample = -1; sample < head[0]; sample++) {
        if (sample >= 0) {
            if (places[sample] != INT32_MIN) {
                drive.ramped = places[sample]; /* a slow ramp is put where samples would take minutes to bring it */
            }
            if (words[sample] != INT32_MIN) {
                drive.at_rest = (uint16_t)(words[sample] & 1);
                drive.side = (int16_t)(((words[sample] >> 1) & 3) - 1);
                drive.rising = (uint16_t)((words[sample] >> 3) & 63);
                drive.played = (int16_t)((words[sample] >> 9) - 8192);
            }
            if (sound[sample] != INT32_MIN) {
                drive.valid_commands = (uint16_t)(sound[sample] & 0x7FFF);
                drive.valid_pressures = (uint16_t)(sound[sample] >> 15);
                drive.faulty_commands = (uint16_t)(faulty[sample] & 0x7FFF);
                drive.faulty_pressures = (uint16_t)(faulty[sample] >> 15);
            }
            dz_drive_sample(&drive, codes[3 * sample], codes[3 * sample + 1], codes[3 * sample + 2]);
        }
        for (int32_t tick = 0; tick < head[1] && whole; tick++) {
            dz_drive_tick(&drive);
            found.ticks++;
            whole = compare(&drive, file, &found);
        }
    }
    free(codes);
    free(places);
    printf("%ld %ld %ld %ld\n", found.ticks, found.wrong, found.first, found.first_field);
    return whole ? 0 : 2;
}

int main(int count, char **arguments)
{
    FILE *file = count > 1 ? fopen(arguments[1], "rb") : NULL;
    int status;

    if (file == NULL) {
        fputs("nothing to run\n", stderr);
        return 2;
    }
    status = run(file);
    fclose(file);
    return status;
}
