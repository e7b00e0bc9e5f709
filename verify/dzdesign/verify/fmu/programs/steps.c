/* Co-Simulation of a compensator, a step a row: what the inputs are, and after the step what the outputs are. The file
 * named first holds the number of inputs that are integers (0: all are reals), of outputs and of rows, then value
 * references of inputs and outputs, all of 32 bits; then the step's size and, a row each, the inputs, as doubles. */
#include "fmi_calls.h"

#define MOST 8

static void *read_whole(const char *name)
{
    FILE *file = fopen(name, "rb");
    long size = 0;
    char *content = NULL;

    if (file != NULL && fseek(file, 0L, SEEK_END) == 0) {
        size = ftell(file);
        rewind(file);
        content = malloc((size_t)size);
        if (content != NULL && fread(content, 1u, (size_t)size, file) != (size_t)size) {
            content = NULL;
        }
        fclose(file);
    }
    if (content == NULL) {
        fail("nothing to do");
    }
    return content;
}

int main(int count, char **arguments)
{
    struct fmu fmu = {0};
    const char *content = (count > 1) ? read_whole(arguments[1]) : NULL;
    const uint32_t *head = (const uint32_t *)content;

    if (!fmu_instantiate(&fmu, FMU_PATH, FMU_VERSION, FMU_TOKEN, 1)) {
        fail("the binary refuses the token of its modelDescription.xml");
    }
    {
        struct fmu other = {0};

        if (fmu_instantiate(&other, FMU_PATH, FMU_VERSION, FMU_TOKEN "x", 1)) {
            fail("the binary takes another token than that of its modelDescription.xml");
        }
    }
    if (head == NULL) {
        return 2;
    }
    const uint32_t integers = head[0];
    const uint32_t outputs = head[1];
    const uint32_t rows = head[2];
    const uint32_t *from = &head[4];
    const uint32_t *to = &from[4];
    const double *values = (const double *)(to + MOST);
    const double size = *values++;

    set_bool(&fmu, REF_CODES, integers > 0u);
    fmu_initialize(&fmu);
    for (uint32_t row = 0; row < rows; row++) {
        double reals[3] = {values[3u * row], values[3u * row + 1u], values[3u * row + 2u]};
        int32_t codes[3] = {(int32_t)reals[0], (int32_t)reals[1], (int32_t)reals[2]};
        int32_t found_[MOST];

        if (integers > 0u) {
            set_ints(&fmu, from, 3u, codes);
        } else {
            set_reals(&fmu, from, 3u, reals);
        }
        step(&fmu, size * (double)row, size);
        get_ints(&fmu, to, outputs, found_);
        for (uint32_t output = 0; output < outputs; output++) {
            printf("%ld ", (long)found_[output]);
        }
        puts("");
    }
    return 0;
}
