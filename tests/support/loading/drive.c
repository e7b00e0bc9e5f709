/* The generated code that takes a calibration block, on the host: as a library, octet by octet, for the tests, and with
 * DRIVE_PROGRAM as a drive on a serial line. Its memory outlives the supply; it can be cut at each octet that comes and
 * at each word that is erased or written. */
#include <stddef.h>
#include <string.h>

#include "dz_load.h"

#define WORDS (sizeof(struct dz_slot) / sizeof(uint16_t))
#define LINE_OCTETS 4096u

struct drive
{
    struct dz_slot slots[DZ_STORE_SLOTS];
    struct dz_calibration linked;
};

static struct drive own;
static struct drive *memory = &own;
static struct dz_load load;
static const struct dz_calibration *used;
static uint16_t ticks, hold, busy, busy_left;
static uint32_t random_state = 1u;
static uint8_t line[LINE_OCTETS];
static unsigned line_count;

/* What a test sets and reads. */
int drive_dead;           /* the supply is gone */
long drive_octets_left = -1, drive_words_left = -1; /* until it goes; below zero: never */
int drive_driving;        /* the output is in use */
int drive_command = 0;    /* the command is not zero */
int drive_new_command = 0; /* it is not the zero command of a block that is not in use */
int drive_never_holds;    /* the interrupt does not come */
int drive_bad_word = -1;  /* a word of the memory that takes nothing */
unsigned drive_uses, drive_wrong_uses; /* times that a block was taken into use; while the output was not held */
unsigned long drive_words; /* erased and written so far */
int drive_erase_ticks;     /* that an erase takes, in which nothing else runs but the interrupt */
int drive_late_ticks;      /* so many went by in erases, and nobody else has seen them yet */
unsigned drive_erases;

static uint16_t random_word(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (uint16_t)(random_state >> 16);
}

/* A word changes; cut short, some of its bits do. */
static void change(uint16_t *word, uint16_t to)
{
    if (drive_dead != 0)
    {
        return;
    }
    drive_words++;
    if (drive_words_left == 0)
    {
        const uint16_t some = random_word();

        *word = (uint16_t)((*word & ~some) | (to & some));
        drive_dead = 1;
        return;
    }
    drive_words_left -= (drive_words_left > 0) ? 1 : 0;
    *word = to;
}

static void change_at(uint16_t slot, unsigned at, uint16_t to)
{
    uint16_t word;

    memcpy(&word, (unsigned char *)&memory->slots[slot] + 2u * at, sizeof word);
    change(&word, to);
    memcpy((unsigned char *)&memory->slots[slot] + 2u * at, &word, sizeof word);
}

void dz_store_init(void) {}

const struct dz_slot *dz_store_slot(uint16_t slot)
{
    return &memory->slots[slot];
}

uint16_t dz_store_erase(uint16_t slot)
{
    if (busy_left > 0u)
    {
        busy_left--;
        return DZ_STORE_BUSY;
    }
    busy_left = busy;
    drive_erases++;
    ticks = (uint16_t)(ticks + (unsigned)drive_erase_ticks);
    drive_late_ticks += drive_erase_ticks;
    /* As flash does it: first all bits to 0, then all to 1. */
    for (unsigned at = 0u; at < WORDS; at++)
    {
        change_at(slot, at, 0u);
    }
    for (unsigned at = 0u; at < WORDS; at++)
    {
        change_at(slot, at, 0xFFFFu);
    }
    return DZ_STORE_DONE;
}

uint16_t dz_store_write(uint16_t slot, uint16_t at, const uint16_t *words, uint16_t count)
{
    for (unsigned i = 0u; i < count; i++)
    {
        uint16_t word;

        memcpy(&word, (unsigned char *)&memory->slots[slot] + 2u * (at + i), sizeof word);
        /* Flash only turns bits from 1 to 0. */
        change_at(slot, at + i, (uint16_t)(((int)(at + i) == drive_bad_word) ? word : (word & words[i])));
    }
    return DZ_STORE_DONE;
}

uint16_t dz_load_refusal(const struct dz_calibration *block)
{
    if ((drive_new_command != 0) && (block != used))
    {
        return DZ_LOAD_REASON_COMMAND;
    }
    if ((drive_driving != 0) && (hold == 0u))
    {
        return DZ_LOAD_REASON_DRIVING;
    }
    return (drive_command != 0) ? DZ_LOAD_REASON_COMMAND : 0u;
}

uint16_t dz_load_hold(uint16_t wanted)
{
    hold = (drive_never_holds != 0) ? 0u : wanted;
    return hold;
}

void dz_load_use(const struct dz_calibration *block)
{
    used = block;
    drive_uses++;
    drive_wrong_uses += (hold == 0u) ? 1u : 0u;
}

/* The supply comes back: what is not in the slots is as at a start. */
void drive_power_on(unsigned seed, unsigned busy_polls)
{
    drive_dead = 0;
    drive_octets_left = drive_words_left = -1;
    drive_driving = drive_command = drive_new_command = drive_never_holds = 0;
    drive_bad_word = -1;
    drive_erase_ticks = drive_late_ticks = 0;
    drive_erases = 0u;
    random_state = seed;
    busy = busy_left = (uint16_t)busy_polls;
    hold = 0u;
    line_count = 0u;
    drive_uses = drive_wrong_uses = 0u;
    drive_words = 0u;
    dz_load_init(&load, &memory->linked);
    used = load.block;
}

void *drive_memory(int slot) { return (slot < (int)DZ_STORE_SLOTS) ? (void *)&memory->slots[slot] : (void *)&memory->linked; }

/* What the drive works with: null without a block, or without supply. */
const void *drive_block(void) { return (drive_dead == 0) ? used : NULL; }

unsigned drive_used(void) { return load.used; }

unsigned drive_is_held(void) { return hold; }

unsigned drive_ended(void) { return load.ended; }

static void pass(void)
{
    if (drive_dead != 0)
    {
        return;
    }
    dz_load_poll(&load, ticks);
    if ((load.reply_octets != 0u) && (drive_dead == 0))
    {
        for (unsigned i = 0u; (i < load.reply_octets) && (line_count < LINE_OCTETS); i++)
        {
            line[line_count++] = (uint8_t)load.reply[i];
        }
        load.reply_octets = 0u;
    }
}

/* So many ticks go by, with that many passes of the main loop. */
void drive_wait(unsigned count, unsigned passes)
{
    ticks = (uint16_t)(ticks + count);
    for (unsigned i = 0u; i < passes; i++)
    {
        pass();
    }
}

void drive_feed(const uint8_t *octets, unsigned count)
{
    for (unsigned i = 0u; (i < count) && (drive_dead == 0); i++)
    {
        if (drive_octets_left == 0)
        {
            drive_dead = 1;
            return;
        }
        drive_octets_left -= (drive_octets_left > 0) ? 1 : 0;
        dz_load_receive(&load.receiver, octets[i], ticks);
        pass();
    }
}

/* What the drive has sent since the last call. */
unsigned drive_take(uint8_t *octets, unsigned most)
{
    const unsigned count = (line_count < most) ? line_count : most;

    memcpy(octets, line, count);
    line_count -= count;
    memmove(line, line + count, line_count);
    return count;
}

#ifdef DRIVE_PROGRAM

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#define TICKS_PER_S 2500u

static uint16_t ticks_now(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint16_t)((uint64_t)now.tv_sec * TICKS_PER_S + (uint64_t)now.tv_nsec * TICKS_PER_S / 1000000000u);
}

/* drive MEMORY [octets N] [words N] [driving 1] [command 1] [busy N]: a drive on stdin and stdout; its supply goes after
 * so many octets or words. The file MEMORY is its flash. */
int main(int count, char **words)
{
    const int file = (count > 1) ? open(words[1], O_RDWR) : -1;
    long busy_polls = 0, octets = -1, cut = -1, driving = 0, command = 0;

    for (int i = 2; i + 1 < count; i += 2)
    {
        const long value = atol(words[i + 1]);

        octets = (strcmp(words[i], "octets") == 0) ? value : octets;
        cut = (strcmp(words[i], "words") == 0) ? value : cut;
        driving = (strcmp(words[i], "driving") == 0) ? value : driving;
        command = (strcmp(words[i], "command") == 0) ? value : command;
        busy_polls = (strcmp(words[i], "busy") == 0) ? value : busy_polls;
    }
    memory = mmap(NULL, sizeof *memory, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED)
    {
        return 1;
    }
    drive_power_on(1u, (unsigned)busy_polls);
    drive_octets_left = octets;
    drive_words_left = cut;
    drive_driving = (int)driving;
    drive_command = (int)command;
    fprintf(stderr, "ready %u\n", load.used);
    while (drive_dead == 0)
    {
        struct pollfd in = {STDIN_FILENO, POLLIN, 0};
        uint8_t some[16];

        if (poll(&in, 1, 1) > 0)
        {
            const ssize_t got = read(STDIN_FILENO, some, sizeof some);

            if (got <= 0)
            {
                break;
            }
            ticks = ticks_now();
            drive_feed(some, (unsigned)got);
        }
        ticks = ticks_now();
        pass();
        if (line_count > 0u)
        {
            (void)!write(STDOUT_FILENO, line, line_count);
            line_count = 0u;
        }
    }
    return 0;
}
#endif
