/* The check on this machine: what was prepared comes from the file named first; the numbers found go to stdout, then
 * what the core gave at zero command. With `sample` behind it the sample is tried, else all. Of a core in block form its
 * calibration block comes from the file named last. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "every_input.h"

static void put(uint32_t number)
{
    printf("%lu ", (unsigned long)number);
}

#ifdef DZ_HELD
int dz_hold(const void *octets, unsigned long size);
#endif

static uint8_t *read_whole(const char *name, long *size)
{
    FILE *file = fopen(name, "rb");
    uint8_t *content = NULL;

    if (file != NULL && fseek(file, 0L, SEEK_END) == 0) {
        *size = ftell(file);
        rewind(file);
        content = *size > 0 ? malloc((size_t)*size) : NULL;
        if (content != NULL && fread(content, 1u, (size_t)*size, file) != (size_t)*size) {
            free(content);
            content = NULL;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    return content;
}

int main(int count, char **arguments)
{
    long size = 0;
    uint8_t *prepared = count > 1 ? read_whole(arguments[1], &size) : NULL;
    struct dz_findings findings;
#ifdef DZ_HELD
    uint8_t *block = count > 2 ? read_whole(arguments[count - 1], &size) : NULL;

    if (block == NULL || dz_hold(block, (unsigned long)size) != 0) {
        fputs("no calibration block of this core\n", stderr);
        return 2;
    }
    free(block);
#endif

    if (prepared == NULL) {
        fputs("nothing to check\n", stderr);
        return 2;
    }
    if (count > 2 && strcmp(arguments[2], "sample") == 0) {
        dz_check_sample(prepared, &findings);
        dz_put_findings(&findings, put);
    } else {
        const struct dz_plan *plan = (const struct dz_plan *)prepared;
        uint16_t *work = calloc((size_t)plan->codes * 3u, sizeof *work);
        uint16_t *at_zero = calloc((size_t)plan->rows, sizeof *at_zero);

        if (work == NULL || at_zero == NULL) {
            fputs("no memory\n", stderr);
            return 2;
        }
        dz_check_everything(prepared, work, at_zero, &findings);
        dz_put_findings(&findings, put);
        puts("");
        for (int32_t row = 0; row < plan->rows; row++) {
            put(at_zero[row]);
        }
        free(at_zero);
        free(work);
    }
    puts("");
    free(prepared);
    return 0;
}
