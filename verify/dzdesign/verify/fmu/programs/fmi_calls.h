/* An FMU's binary, loaded, and what of FMI 2 and 3 the checks call: written from the standard. A call that fails ends the
 * program, but for those that ask whether it does. */
#ifndef FMI_CALLS_H
#define FMI_CALLS_H

#include <math.h>
#include <stdbool.h>

#include "results.h"

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

typedef int status_2(void *instance);
typedef int values_2(void *instance, const uint32_t *references, size_t count, void *values);
typedef int values_3(void *instance, const uint32_t *references, size_t count, void *values, size_t sizes);

struct event_info_2 {
    int needed, terminate, nominals, values, defined;
    double time;
};

struct callbacks_2 {
    void (*log)(void *environment, const char *name, int status, const char *category, const char *message, ...);
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*finished)(void *environment, int status);
    void *environment;
};

struct fmu {
    void *library;
    int version;
    int reason; /* why there is no instance: 1: refused */
    void *instance;
    values_2 *get_real_2, *set_real_2, *get_int_2, *set_int_2, *set_bool_2;
    values_3 *get_real_3, *set_real_3, *get_int_3, *set_int_3, *set_bool_3;
    int (*step_2)(void *instance, double time, double step, int no_return);
    int (*step_3)(void *instance, double time, double step, bool no_return, bool *event, bool *terminate, bool *early,
                  double *last);
};

/* A function of the binary, as a pointer of another type of function. */
static void (*found(const struct fmu *fmu, const char *name))(void)
{
#ifdef _WIN32
    void (*function)(void) = (void (*)(void))GetProcAddress((HMODULE)fmu->library, name);
#else
    void (*function)(void);

    *(void **)&function = dlsym(fmu->library, name);
#endif
    if (function == NULL) {
        fail(name);
    }
    return function;
}

static void log_nothing(void *environment, const char *name, int status, const char *category, const char *message, ...)
{
    (void)environment;
    (void)name;
    (void)status;
    (void)category;
    (void)message;
}

static void log_nothing_3(void *environment, int status, const char *category, const char *message)
{
    (void)environment;
    (void)status;
    (void)category;
    (void)message;
}

/* Loads a binary and makes an instance; whether it was made. */
static int fmu_instantiate(struct fmu *fmu, const char *path, int version, const char *token, int co_simulation)
{
    static struct callbacks_2 callbacks;

    fmu->version = version;
#ifdef _WIN32
    fmu->library = (void *)LoadLibraryA(path);
#else
    fmu->library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
#endif
    if (fmu->library == NULL) {
        fail("the binary can't be loaded");
    }
    callbacks.log = log_nothing;
    callbacks.allocate = calloc;
    callbacks.release = free;
    if (version == 2) {
        typedef void *make(const char *, int, const char *, const char *, const struct callbacks_2 *, int, int);

        fmu->get_real_2 = (values_2 *)found(fmu, "fmi2GetReal");
        fmu->set_real_2 = (values_2 *)found(fmu, "fmi2SetReal");
        fmu->get_int_2 = (values_2 *)found(fmu, "fmi2GetInteger");
        fmu->set_int_2 = (values_2 *)found(fmu, "fmi2SetInteger");
        fmu->set_bool_2 = (values_2 *)found(fmu, "fmi2SetBoolean");
        fmu->step_2 = (int (*)(void *, double, double, int))found(fmu, "fmi2DoStep");
        fmu->instance = ((make *)found(fmu, "fmi2Instantiate"))("checked", co_simulation, token, "", &callbacks, 0, 0);
    } else {
        typedef void *exchange(const char *, const char *, const char *, bool, bool, void *, void *);
        typedef void *simulation(const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *,
                                 size_t, void *, void *, void *);

        fmu->get_real_3 = (values_3 *)found(fmu, "fmi3GetFloat64");
        fmu->set_real_3 = (values_3 *)found(fmu, "fmi3SetFloat64");
        fmu->get_int_3 = (values_3 *)found(fmu, "fmi3GetInt32");
        fmu->set_int_3 = (values_3 *)found(fmu, "fmi3SetInt32");
        fmu->set_bool_3 = (values_3 *)found(fmu, "fmi3SetBoolean");
        fmu->step_3 =
            (int (*)(void *, double, double, bool, bool *, bool *, bool *, double *))found(fmu, "fmi3DoStep");
        fmu->instance =
            co_simulation
                ? ((simulation *)found(fmu, "fmi3InstantiateCoSimulation"))("checked", token, "", false, false, false,
                                                                            false, NULL, 0u, NULL,
                                                                            (void *)log_nothing_3, NULL)
                : ((exchange *)found(fmu, "fmi3InstantiateModelExchange"))("checked", token, "", false, false, NULL,
                                                                           (void *)log_nothing_3);
    }
    return fmu->instance != NULL;
}

static void set_bool(struct fmu *fmu, uint32_t reference, int value)
{
    int of_2 = value;
    bool of_3 = (value != 0);

    need(fmu->version == 2 ? fmu->set_bool_2(fmu->instance, &reference, 1u, &of_2)
                           : fmu->set_bool_3(fmu->instance, &reference, 1u, &of_3, 1u),
         "a boolean can't be set");
}

/* From instantiation through initialization: then in Event Mode, or ready for steps. */
static void fmu_initialize(struct fmu *fmu)
{
    if (fmu->version == 2) {
        typedef int setup(void *, int, double, double, int, double);

        need(((setup *)found(fmu, "fmi2SetupExperiment"))(fmu->instance, 0, 0.0, 0.0, 0, 0.0), "fmi2SetupExperiment");
        need(((status_2 *)found(fmu, "fmi2EnterInitializationMode"))(fmu->instance), "fmi2EnterInitializationMode");
        need(((status_2 *)found(fmu, "fmi2ExitInitializationMode"))(fmu->instance), "fmi2ExitInitializationMode");
    } else {
        typedef int enter(void *, bool, double, double, bool, double);

        need(((enter *)found(fmu, "fmi3EnterInitializationMode"))(fmu->instance, false, 0.0, 0.0, false, 0.0),
             "fmi3EnterInitializationMode");
        need(((status_2 *)found(fmu, "fmi3ExitInitializationMode"))(fmu->instance), "fmi3ExitInitializationMode");
    }
}

static void set_ints(struct fmu *fmu, const uint32_t *references, size_t count, int32_t *values)
{
    need(fmu->version == 2 ? fmu->set_int_2(fmu->instance, references, count, values)
                           : fmu->set_int_3(fmu->instance, references, count, values, count),
         "integers can't be set");
}

static void get_ints(struct fmu *fmu, const uint32_t *references, size_t count, int32_t *values)
{
    need(fmu->version == 2 ? fmu->get_int_2(fmu->instance, references, count, values)
                           : fmu->get_int_3(fmu->instance, references, count, values, count),
         "integers can't be got");
}

static inline int try_reals(struct fmu *fmu, const uint32_t *references, size_t count, double *values)
{
    return fmu->version == 2 ? fmu->set_real_2(fmu->instance, references, count, values)
                             : fmu->set_real_3(fmu->instance, references, count, values, count);
}

static inline void set_reals(struct fmu *fmu, const uint32_t *references, size_t count, double *values)
{
    need(try_reals(fmu, references, count, values), "reals can't be set");
}

static inline void get_reals(struct fmu *fmu, const uint32_t *references, size_t count, double *values)
{
    need(fmu->version == 2 ? fmu->get_real_2(fmu->instance, references, count, values)
                           : fmu->get_real_3(fmu->instance, references, count, values, count),
         "reals can't be got");
}

static inline int try_step(struct fmu *fmu, double time, double size)
{
    bool event, terminate, early;
    double last;

    return fmu->version == 2 ? fmu->step_2(fmu->instance, time, size, 1)
                             : fmu->step_3(fmu->instance, time, size, true, &event, &terminate, &early, &last);
}

static inline void step(struct fmu *fmu, double time, double size)
{
    need(try_step(fmu, time, size), "a step fails");
}

/* Steps, at the time that an instance has come to, and inputs, none of which may be taken: no sizes, no times, no numbers. */
static inline void refuses(struct fmu *fmu, double time, double size, uint32_t real)
{
    const double infinity = HUGE_VAL, nothing = HUGE_VAL - HUGE_VAL;
    const double steps[][2] = {{time, 0.0}, {time, -size}, {time, nothing}, {time, infinity}, {nothing, size},
                               {infinity, size}, {time - 2.0 * size, size}, {time + 2.0 * size, size}};
    double values[] = {infinity, -infinity, nothing};

    for (size_t place = 0; place < sizeof steps / sizeof *steps; place++) {
        if (try_step(fmu, steps[place][0], steps[place][1]) == 0) {
            fail("the binary takes a step of no size or length, or that does not begin where the last one ended");
        }
    }
    for (size_t place = 0; place < sizeof values / sizeof *values; place++) {
        if (try_reals(fmu, &real, 1u, &values[place]) == 0) {
            fail("the binary takes an input that is no number");
        }
    }
}

#endif
