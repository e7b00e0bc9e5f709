/* What a program finds, in a file that its last argument names: what an FMU's binary prints is no part of it. The last
 * line says that all is there, should a binary end the program. */
#ifndef RESULTS_H
#define RESULTS_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static FILE *results;

static void begin_results(int count, char **arguments)
{
    results = (count > 2) ? fopen(arguments[count - 1], "wb") : NULL;
    if (results == NULL) {
        exit(4);
    }
}

static inline void put(uint32_t number)
{
    fprintf(results, "%lu ", (unsigned long)number);
}

static int end_results(void)
{
    fputs("end\n", results);
    return (fclose(results) == 0) ? 0 : 4;
}

/* Ends the program. */
static void fail(const char *what)
{
    fprintf(results, "\nrefused %s\n", what);
    fclose(results);
    exit(3);
}

static void need(int status, const char *what)
{
    if (status != 0) {
        fail(what);
    }
}

/* What a file holds, whole. */
static void *read_whole(const char *name)
{
    FILE *file = fopen(name, "rb");
    long size = 0;
    char *content = NULL;

    if (file != NULL && fseek(file, 0L, SEEK_END) == 0) {
        size = ftell(file);
        rewind(file);
        content = (size > 0) ? malloc((size_t)size) : NULL;
        if (content != NULL && fread(content, 1u, (size_t)size, file) != (size_t)size) {
            content = NULL;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    if (content == NULL) {
        fail("nothing to do");
    }
    return content;
}

#endif
