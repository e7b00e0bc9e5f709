/* Serves calls of the functions of calls.h, which is generated, over two pipes: a frame in, a frame out, until its input
 * ends. served_calls IN OUT has their numbers; on Windows they are the standard input and output.
 *
 * A call: serial number, 64 bits; place of the function and count of its arguments, 32 bits; for each argument 64 bits,
 * its value or the octets of its buffer, -1 of a null pointer; the buffers that are read. An answer: the serial number,
 * what was returned, the octets that follow; the buffers that were written. */
#define _POSIX_C_SOURCE 200809L
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#define read _read
#define write _write
#else
#include <errno.h>
#include <unistd.h>
#endif

#define MOST_ARGUMENTS 32
/* Most octets that one call of the system moves. */
#define AT_ONCE ((size_t)1 << 20)

union value
{
    int64_t number;
    void *buffer;
};

/* Of each argument a letter: n, a number; i, o or b, a buffer that is read, written or both. */
struct function
{
    int64_t (*call)(const union value *values);
    const char *arguments;
};

#include "calls.h"

struct asked
{
    uint64_t serial;
    uint32_t function;
    uint32_t arguments;
};

struct answered
{
    uint64_t serial;
    int64_t returned;
    uint64_t octets;
};

static void fail(const char *why)
{
    fprintf(stderr, "%s\n", why);
    exit(3);
}

/* Read so many octets; 0 where the input has ended. */
static int take(int from, void *to, size_t octets)
{
    char *at = to;

    while (octets > 0) {
        const ptrdiff_t found = read(from, at, octets < AT_ONCE ? octets : AT_ONCE);

        if (found > 0) {
            at += found;
            octets -= (size_t)found;
        } else {
#ifndef _WIN32
            if (found < 0 && errno == EINTR) {
                continue;
            }
#endif
            return 0;
        }
    }
    return 1;
}

static void give(int to, const void *from, size_t octets)
{
    const char *at = from;

    while (octets > 0) {
        const ptrdiff_t given = write(to, at, octets < AT_ONCE ? octets : AT_ONCE);

        if (given >= 0) {
            at += given;
            octets -= (size_t)given;
        } else {
#ifndef _WIN32
            if (errno == EINTR) {
                continue;
            }
#endif
            exit(0); /* nobody reads */
        }
    }
}

static void serve(int in, int out, const struct asked *asked)
{
    const struct function *function = &functions[asked->function];
    int64_t given[MOST_ARGUMENTS];
    union value values[MOST_ARGUMENTS];
    struct answered answered = {asked->serial, 0, 0u};

    if (!take(in, given, asked->arguments * sizeof given[0])) {
        fail("a call ends early");
    }
    for (uint32_t place = 0u; place < asked->arguments; place++) {
        const char kind = function->arguments[place];
        const size_t octets = given[place] < 0 ? 0u : (size_t)given[place];

        values[place].number = given[place];
        if (kind == 'n') {
            continue;
        }
        values[place].buffer = given[place] < 0 ? NULL : calloc(octets + 1u, 1u);
        if (given[place] >= 0 && values[place].buffer == NULL) {
            fail("no memory for a buffer");
        }
        if (kind != 'o' && !take(in, values[place].buffer, octets)) {
            fail("a call ends early");
        }
        answered.octets += kind == 'i' ? 0u : octets;
    }
    answered.returned = function->call(values);
    give(out, &answered, sizeof answered);
    for (uint32_t place = 0u; place < asked->arguments; place++) {
        const char kind = function->arguments[place];

        if (kind == 'o' || kind == 'b') {
            give(out, values[place].buffer, given[place] < 0 ? 0u : (size_t)given[place]);
        }
        if (kind != 'n') {
            free(values[place].buffer);
        }
    }
}

int main(int count, char **arguments)
{
    struct asked asked;
#ifdef _WIN32
    /* What the functions print goes nowhere. */
    const int in = _dup(0), out = _dup(1), nowhere = _open("NUL", _O_RDWR);

    (void)count;
    (void)arguments;
    if (in < 0 || out < 0 || nowhere < 0 || _dup2(nowhere, 0) != 0 || _dup2(nowhere, 1) != 0) {
        fail("no standard input and output");
    }
    (void)_setmode(in, _O_BINARY);
    (void)_setmode(out, _O_BINARY);
#else
    if (count < 3) {
        fail("no pipes");
    }
    const int in = atoi(arguments[1]), out = atoi(arguments[2]);
#endif
    while (take(in, &asked, sizeof asked)) {
        if (asked.function >= sizeof functions / sizeof functions[0]
            || asked.arguments != strlen(functions[asked.function].arguments)) {
            fail("no such function");
        }
        serve(in, out, &asked);
    }
    return 0;
}
