/* The core's functions as the check of every input calls them, by the getters of an FMU's binary: Model Exchange, in
 * Event Mode, where outputs follow inputs at once. Declarations of FMI 2.0, written from the standard. */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

uint16_t DZ_CORE(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t DZ_STATUS(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t DZ_BETA(uint16_t p_a_adc, uint16_t p_b_adc);

typedef void function(void);
typedef int set_integers(void *instance, const uint32_t *references, size_t count, const int32_t *values);
typedef int get_integers(void *instance, const uint32_t *references, size_t count, int32_t *values);
typedef int get_reals(void *instance, const uint32_t *references, size_t count, double *values);
typedef int of_instance(void *instance);
typedef int setup(void *instance, int tolerances, double tolerance, double start, int stops, double stop);

struct callbacks {
    void (*log)(void *environment, const char *name, int status, const char *category, const char *message, ...);
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*finished)(void *environment, int status);
    void *environment;
};
typedef void *instantiate(const char *name, int co_simulation, const char *token, const char *resources,
                          const struct callbacks *callbacks, int visible, int logging);

static void *library, *instance;
static set_integers *set_integer;
static get_integers *get_integer;
static get_reals *get_real;

static void need(int holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "%s\n", what);
        exit(3);
    }
}

static function *found(const char *name)
{
#ifdef _WIN32
    function *one = (function *)GetProcAddress((HMODULE)library, name);
#else
    function *one;

    *(void **)&one = dlsym(library, name);
#endif
    need(one != NULL, name);
    return one;
}

static void begin(void)
{
    static const uint32_t codes = REF_CODES;
    static const int32_t yes = 1;
    static struct callbacks callbacks;

    callbacks.allocate = calloc;
    callbacks.release = free;
#ifdef _WIN32
    library = (void *)LoadLibraryA(FMU_PATH);
#else
    library = dlopen(FMU_PATH, RTLD_NOW | RTLD_LOCAL);
#endif
    need(library != NULL, "the binary can't be loaded");
    set_integer = (set_integers *)found("fmi2SetInteger");
    get_integer = (get_integers *)found("fmi2GetInteger");
    get_real = (get_reals *)found("fmi2GetReal");
    instance = ((instantiate *)found("fmi2Instantiate"))("checked", 0, FMU_TOKEN, "", &callbacks, 0, 0);
    need(instance != NULL, "the binary refuses the guid of its modelDescription.xml");
    need(((set_integers *)found("fmi2SetBoolean"))(instance, &codes, 1u, &yes) == 0, "fmi2SetBoolean");
    need(((setup *)found("fmi2SetupExperiment"))(instance, 0, 0.0, 0.0, 0, 0.0) == 0, "fmi2SetupExperiment");
    need(((of_instance *)found("fmi2EnterInitializationMode"))(instance) == 0, "fmi2EnterInitializationMode");
    need(((of_instance *)found("fmi2ExitInitializationMode"))(instance) == 0, "fmi2ExitInitializationMode");
}

static void give(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    static const uint32_t inputs[3] = {REF_U_I_CODE, REF_P_A_CODE, REF_P_B_CODE};
    const int32_t codes[3] = {u_adc, p_a_adc, p_b_adc};

    if (instance == NULL) {
        begin();
    }
    need(set_integer(instance, inputs, 3u, codes) == 0, "fmi2SetInteger");
}

static uint16_t integer(uint32_t reference)
{
    int32_t value = -1;

    need(get_integer(instance, &reference, 1u, &value) == 0, "fmi2GetInteger");
    need(value >= 0 && value <= 65535, "an output has more than 16 bits");
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
    need(get_real(instance, &reference, 1u, &beta) == 0, "fmi2GetReal");
    beta *= 32768.0;
    need(beta >= 0.0 && beta <= 65535.0 && beta == (double)(uint16_t)beta, "beta is no multiple of 2^-15");
    return (uint16_t)beta;
}
