/* Co-Simulation of a compensator, a step a row: what the inputs are, and after the step what the outputs are. The file
 * named first holds the number of inputs that are integers (0: all are reals), of outputs and of rows, then value
 * references of inputs and outputs, all of 32 bits; then the step's size and, a row each, the inputs, as doubles. */
#include "fmi_calls.h"

#define MOST 8

int main(int count, char **arguments)
{
    struct fmu fmu = {0};
    const uint32_t *head;

    begin_results(count, arguments);
    head = read_whole(arguments[1]);
    if (!fmu_instantiate(&fmu, FMU_PATH, FMU_TOKEN, 1)) {
        fail("the binary refuses the token of its modelDescription.xml");
    }
    {
        struct fmu other = {0};

        if (fmu_instantiate(&other, FMU_PATH, FMU_TOKEN "x", 1)) {
            fail("the binary takes another token than that of its modelDescription.xml");
        }
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
            fprintf(results, "%ld ", (long)found_[output]);
        }
        fputs("\n", results);
    }
    refuses(&fmu, size * (double)rows, size, from[0] == REF_U_I_CODE ? REF_U_I : from[0]);
    return end_results();
}
