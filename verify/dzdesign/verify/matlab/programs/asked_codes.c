/* Between the check of every input and what it checks: with DZ_RECORD the compiled core is called, and the codes that are
 * asked for are kept in files, in their order; without it the answers come from files, each for the codes at its place. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

uint16_t DZ_CORE(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t DZ_STATUS(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t DZ_BETA(uint16_t p_a_adc, uint16_t p_b_adc);
#ifdef DZ_RECORD
uint16_t DZ_COMPILED_CORE(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t DZ_COMPILED_STATUS(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t DZ_COMPILED_BETA(uint16_t p_a_adc, uint16_t p_b_adc);
#endif

/* Inputs in one reading. */
#define HELD 4096u
/* What is given for codes that are not the next ones: the check asks once more where an answer is wrong. */
#define NO_ANSWER 65535u

struct asked {
    FILE *codes;
    const char *codes_path;
    FILE *answers;
    const char *answers_path;
    size_t held, next;
    uint16_t code[HELD][3];
    uint16_t answer[HELD];
};

static struct asked of_core = {.codes_path = DZ_CODES_CORE, .answers_path = DZ_ANSWERS_CORE};
static struct asked of_status = {.codes_path = DZ_CODES_STATUS, .answers_path = DZ_ANSWERS_STATUS};
static struct asked of_beta = {.codes_path = DZ_CODES_BETA, .answers_path = DZ_ANSWERS_BETA};

static void fail(const char *reason)
{
    fprintf(stderr, "%s\n", reason);
    exit(3);
}

static FILE *opened(const char *path, const char *mode)
{
    FILE *file = fopen(path, mode);

    if (file == NULL) {
        fail("a file of codes or answers can't be opened");
    }
    return file;
}

#ifdef DZ_RECORD
static void write_held(struct asked *asked)
{
    if (asked->codes != NULL && fwrite(asked->code, sizeof asked->code[0], asked->held, asked->codes) != asked->held) {
        fail("the codes can't be written");
    }
    asked->held = 0;
}

static void write_all(void)
{
    struct asked *all[3] = {&of_core, &of_status, &of_beta};

    for (int each = 0; each < 3; each++) {
        write_held(all[each]);
        if (all[each]->codes != NULL && fclose(all[each]->codes) != 0) {
            fputs("the codes can't be written\n", stderr);
            _Exit(3);
        }
    }
}

static void keep(struct asked *asked, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    uint16_t *code;

    if (asked->codes == NULL) {
        if (of_core.codes == NULL && of_status.codes == NULL && of_beta.codes == NULL) {
            (void)atexit(write_all);
        }
        asked->codes = opened(asked->codes_path, "wb");
    }
    if (asked->held == HELD) {
        write_held(asked);
    }
    code = asked->code[asked->held++];
    code[0] = u_adc;
    code[1] = p_a_adc;
    code[2] = p_b_adc;
}

uint16_t DZ_CORE(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    keep(&of_core, u_adc, p_a_adc, p_b_adc);
    return DZ_COMPILED_CORE(u_adc, p_a_adc, p_b_adc);
}

uint16_t DZ_STATUS(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    keep(&of_status, u_adc, p_a_adc, p_b_adc);
    return DZ_COMPILED_STATUS(u_adc, p_a_adc, p_b_adc);
}

uint16_t DZ_BETA(uint16_t p_a_adc, uint16_t p_b_adc)
{
    keep(&of_beta, DZ_ANY_COMMAND, p_a_adc, p_b_adc);
    return DZ_COMPILED_BETA(p_a_adc, p_b_adc);
}
#else
static void read_more(struct asked *asked)
{
    if (asked->codes == NULL) {
        asked->codes = opened(asked->codes_path, "rb");
        asked->answers = opened(asked->answers_path, "rb");
    }
    asked->held = fread(asked->code, sizeof asked->code[0], HELD, asked->codes);
    if (fread(asked->answer, sizeof asked->answer[0], HELD, asked->answers) != asked->held) {
        fail("there are more or fewer answers than codes");
    }
    asked->next = 0;
}

/* Says at the end whether every answer was asked for. */
static void see_the_end(void)
{
    struct asked *all[3] = {&of_core, &of_status, &of_beta};

    for (int each = 0; each < 3; each++) {
        if (all[each]->next == all[each]->held && all[each]->codes != NULL) {
            read_more(all[each]);
        }
        if (all[each]->next != all[each]->held) {
            fputs("answers are left that were not asked for\n", stderr);
            fflush(stdout);
            _Exit(3);
        }
    }
}

static uint16_t answered(struct asked *asked, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    const uint16_t *code;

    if (of_core.codes == NULL && of_status.codes == NULL && of_beta.codes == NULL) {
        (void)atexit(see_the_end);
    }
    if (asked->next == asked->held) {
        read_more(asked);
    }
    code = asked->code[asked->next];
    if (asked->next == asked->held || code[0] != u_adc || code[1] != p_a_adc || code[2] != p_b_adc) {
        return NO_ANSWER;
    }
    return asked->answer[asked->next++];
}

uint16_t DZ_CORE(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return answered(&of_core, u_adc, p_a_adc, p_b_adc);
}

uint16_t DZ_STATUS(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return answered(&of_status, u_adc, p_a_adc, p_b_adc);
}

uint16_t DZ_BETA(uint16_t p_a_adc, uint16_t p_b_adc)
{
    return answered(&of_beta, DZ_ANY_COMMAND, p_a_adc, p_b_adc);
}
#endif
