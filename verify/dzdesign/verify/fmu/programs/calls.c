/* Calls of an FMU, one after the other, as the file named first has them: kind, value reference and two numbers, doubles
 * all. Of a call that gives something its numbers are a line of results: integers, or reals as the bits of a double. */
#include <string.h>

#include "fmi_calls.h"

enum call {
    SET_REAL, SET_INTEGER, SET_BOOLEAN, GET_REAL, GET_INTEGER, INITIALIZE, STEP, CONTINUE, EVENT, DISCRETE, STATE,
    STATES,
    RATES, INDICATORS, COMPLETED, TIME
};
#define MOST 3

typedef int array_of(void *instance, double *values, size_t count);

static void put_real(double value)
{
    uint64_t bits;

    memcpy(&bits, &value, sizeof bits);
    fprintf(results, "%llu ", (unsigned long long)bits);
}

static void alone(const struct fmu *fmu, const char *name)
{
    need(((status *)found(fmu, name))(fmu->instance), name);
}

static void numbers(const struct fmu *fmu, const char *name, double *values, size_t count)
{
    need(((array_of *)found(fmu, name))(fmu->instance, values, count), name);
}

/* Event Mode: whether states changed, and the next event. */
static void discrete(const struct fmu *fmu)
{
    typedef int update(void *, struct event_info *);
    struct event_info info = {1, 1, 1, 1, 1, -1.0};

    need(((update *)found(fmu, "fmi2NewDiscreteStates"))(fmu->instance, &info), "fmi2NewDiscreteStates");
    need(info.needed || info.terminate, "fmi2NewDiscreteStates asks for more, or for the end");
    fprintf(results, "%d %d ", info.values != 0, info.defined != 0);
    put_real(info.defined ? info.time : 0.0);
}

static void completed(const struct fmu *fmu)
{
    typedef int call(void *, int, int *, int *);
    int event = 0, end = 0;

    need(((call *)found(fmu, "fmi2CompletedIntegratorStep"))(fmu->instance, 1, &event, &end), "a completed step");
}

int main(int count, char **arguments)
{
    struct fmu fmu = {0};
    double held[MOST] = {0.0};
    const double *each;

    begin_results(count, arguments);
    each = read_whole(arguments[1]);
    if (!fmu_instantiate(&fmu, FMU_PATH, FMU_TOKEN, each[1] != 0.0)) {
        fail("the binary refuses the token of its modelDescription.xml");
    }
    for (int64_t left = (int64_t)*each; left > 0; left--) {
        double values[MOST] = {0.0}, real, time;
        uint32_t reference;
        int32_t integer;

        each += 4;
        reference = (uint32_t)each[1];
        real = each[2];
        integer = (int32_t)each[2];
        time = each[2];
        switch ((enum call)(int)each[0]) {
        case SET_REAL: set_reals(&fmu, &reference, 1u, &real); break;
        case SET_INTEGER: set_ints(&fmu, &reference, 1u, &integer); break;
        case SET_BOOLEAN: set_bool(&fmu, reference, integer); break;
        case GET_REAL: get_reals(&fmu, &reference, 1u, &real); put_real(real); fputs("\n", results); break;
        case GET_INTEGER:
            get_ints(&fmu, &reference, 1u, &integer);
            fprintf(results, "%lu\n", (unsigned long)(uint32_t)integer);
            break;
        case INITIALIZE: fmu_initialize(&fmu); break;
        case STEP: step(&fmu, time, each[3]); break;
        case CONTINUE: alone(&fmu, "fmi2EnterContinuousTimeMode"); break;
        case EVENT: alone(&fmu, "fmi2EnterEventMode"); break;
        case DISCRETE: discrete(&fmu); fputs("\n", results); break;
        case STATE: held[reference % MOST] = real; break;
        case STATES: numbers(&fmu, "fmi2SetContinuousStates", held, reference); break;
        case COMPLETED: completed(&fmu); break;
        case TIME: {
            typedef int set_time(void *, double);

            need(((set_time *)found(&fmu, "fmi2SetTime"))(fmu.instance, time), "a time");
            break;
        }
        case RATES:
        case INDICATORS:
            if ((int)each[0] == RATES) {
                numbers(&fmu, "fmi2GetDerivatives", values, reference);
            } else {
                numbers(&fmu, "fmi2GetEventIndicators", values, reference);
            }
            for (int place = 0; place < MOST; place++) {
                put_real(values[place]);
            }
            fputs("\n", results);
            break;
        default: fail("no such call");
        }
    }
    return end_results();
}
