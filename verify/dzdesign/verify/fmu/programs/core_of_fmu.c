/* The core's functions as the check of every input calls them, by the getters of an FMU: Model Exchange, in Event Mode.
 * What was prepared comes from the file named first; with `sample` behind it the sample is tried, else all. */
#include <string.h>

#include "every_input.h"
#include "fmi_calls.h"

uint16_t DZ_CORE(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t DZ_STATUS(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t DZ_BETA(uint16_t p_a_adc, uint16_t p_b_adc);

static struct fmu fmu;

static void give(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    static const uint32_t inputs[3] = {REF_U_I_CODE, REF_P_A_CODE, REF_P_B_CODE};
    int32_t codes[3] = {u_adc, p_a_adc, p_b_adc};

    if (fmu.instance == NULL) {
        if (!fmu_instantiate(&fmu, FMU_PATH, FMU_TOKEN, 0)) {
            fail("the binary refuses the token of its modelDescription.xml");
        }
        set_bool(&fmu, REF_CODES, 1);
        fmu_initialize(&fmu);
    }
    set_ints(&fmu, inputs, 3u, codes);
}

static uint16_t integer(uint32_t reference)
{
    int32_t value = -1;

    get_ints(&fmu, &reference, 1u, &value);
    if (value < 0 || value > 65535) {
        fail("an output has more than 16 bits");
    }
    return (uint16_t)value;
}

uint16_t DZ_CORE(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    give(u_adc, p_a_adc, p_b_adc);
    return integer(REF_COMPARE);
}

uint16_t DZ_STATUS(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    give(u_adc, p_a_adc, p_b_adc);
    return integer(REF_STATUS);
}

uint16_t DZ_BETA(uint16_t p_a_adc, uint16_t p_b_adc)
{
    const uint32_t reference = REF_BETA;
    double beta = -1.0;

    give(0u, p_a_adc, p_b_adc);
    get_reals(&fmu, &reference, 1u, &beta);
    beta *= 32768.0;
    if (!(beta >= 0.0 && beta <= 65535.0) || beta != (double)(uint16_t)beta) {
        fail("beta is no multiple of 2^-15");
    }
    return (uint16_t)beta;
}

int main(int count, char **arguments)
{
    struct dz_findings findings;
    const struct dz_plan *plan;
    void *prepared;

    begin_results(count, arguments);
    prepared = read_whole(arguments[1]);
    plan = prepared;
    if (count > 3 && strcmp(arguments[2], "sample") == 0) {
        dz_check_sample(prepared, &findings);
        dz_put_findings(&findings, put);
    } else {
        uint16_t *work = calloc((size_t)plan->codes * 3u, sizeof *work);
        uint16_t *at_zero = calloc((size_t)plan->rows, sizeof *at_zero);

        if (work == NULL || at_zero == NULL) {
            fail("no memory");
        }
        dz_check_everything(prepared, work, at_zero, &findings);
        dz_put_findings(&findings, put);
        fputs("\n", results);
        for (int32_t row = 0; row < plan->rows; row++) {
            put(at_zero[row]);
        }
    }
    fputs("\n", results);
    return end_results();
}
