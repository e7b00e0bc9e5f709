/* An FMU's binary, loaded, and what of FMI 2 the checks call: written from the standard. A call that fails ends the
 * program, but for those that ask whether it does. */
#ifndef FMI_CALLS_H
#define FMI_CALLS_H

#include <math.h>

#include "results.h"

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

typedef int status(void *instance);
typedef int values_of(void *instance, const uint32_t *references, size_t count, void *values);

struct event_info {
    int needed, terminate, nominals, values, defined;
    double time;
};

struct callbacks {
    void (*log)(void *environment, const char *name, int status, const char *category, const char *message, ...);
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*finished)(void *environment, int status);
    void *environment;
};

struct fmu {
    void *library;
    void *instance;
    values_of *get_real, *set_real, *get_int, *set_int, *set_bool;
    int (*step)(void *instance, double time, double step, int no_return);
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

/* Loads a binary and makes an instance; whether it was made. */
static int fmu_instantiate(struct fmu *fmu, const char *path, const char *token, int co_simulation)
{
    typedef void *make(const char *, int, const char *, const char *, const struct callbacks *, int, int);
    static struct callbacks callbacks;

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
    fmu->get_real = (values_of *)found(fmu, "fmi2GetReal");
    fmu->set_real = (values_of *)found(fmu, "fmi2SetReal");
    fmu->get_int = (values_of *)found(fmu, "fmi2GetInteger");
    fmu->set_int = (values_of *)found(fmu, "fmi2SetInteger");
    fmu->set_bool = (values_of *)found(fmu, "fmi2SetBoolean");
    fmu->step = (int (*)(void *, double, double, int))found(fmu, "fmi2DoStep");
    fmu->instance = ((make *)found(fmu, "fmi2Instantiate"))("checked", co_simulation, token, "", &callbacks, 0, 0);
    return fmu->instance != NULL;
}

static void set_bool(struct fmu *fmu, uint32_t reference, int value)
{
    need(fmu->set_bool(fmu->instance, &reference, 1u, &value), "a boolean can't be set");
}

/* From instantiation through initialization: then in Event Mode, or ready for steps. */
static void fmu_initialize(struct fmu *fmu)
{
    typedef int setup(void *, int, double, double, int, double);

    need(((setup *)found(fmu, "fmi2SetupExperiment"))(fmu->instance, 0, 0.0, 0.0, 0, 0.0), "fmi2SetupExperiment");
    need(((status *)found(fmu, "fmi2EnterInitializationMode"))(fmu->instance), "fmi2EnterInitializationMode");
    need(((status *)found(fmu, "fmi2ExitInitializationMode"))(fmu->instance), "fmi2ExitInitializationMode");
}

static void set_ints(struct fmu *fmu, const uint32_t *references, size_t count, int32_t *values)
{
    need(fmu->set_int(fmu->instance, references, count, values), "integers can't be set");
}

static void get_ints(struct fmu *fmu, const uint32_t *references, size_t count, int32_t *values)
{
    need(fmu->get_int(fmu->instance, references, count, values), "integers can't be got");
}

static inline int try_reals(struct fmu *fmu, const uint32_t *references, size_t count, double *values)
{
    return fmu->set_real(fmu->instance, references, count, values);
}

static inline void set_reals(struct fmu *fmu, const uint32_t *references, size_t count, double *values)
{
    need(try_reals(fmu, references, count, values), "reals can't be set");
}

static inline void get_reals(struct fmu *fmu, const uint32_t *references, size_t count, double *values)
{
    need(fmu->get_real(fmu->instance, references, count, values), "reals can't be got");
}

static inline int try_step(struct fmu *fmu, double time, double size)
{
    return fmu->step(fmu->instance, time, size, 1);
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
