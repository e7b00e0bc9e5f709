/* What the core takes on a machine: instructions or cycles of its calls, the stack below them, a valve's memory.
 *
 * Each call is counted beside one of a function that only returns, through the same machine code. With DZ_BLOCK the core
 * is that of block form: it is counted with the block of a valve, then with all the drive functions on that a block of
 * that law can have, at last with the longest shifts too.
 */
#include "dz_drive.h"
#include "machine.h"

/* From a reset on in parts of 128: zero command, one held command and another, of the other sign where there are two,
 * all with sound pressures; at last any codes of the converter. */
#define PART 128u
#define CALLS (8u * PART)
#define PAINTED 512u

#ifdef DZ_BLOCK
#define TAKEN const struct dz_calibration *block,
#define GIVEN &dz_block,
#define ZERO dz_block.command_zero
extern struct dz_calibration dz_block; /* in memory that can be written */
#else
#define TAKEN
#define GIVEN
#define ZERO DZ_DRIVE_COMMAND_ZERO
#endif

typedef uint16_t (*of_codes)(TAKEN uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
typedef void (*of_sample)(TAKEN struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
typedef void (*of_drive)(TAKEN struct dz_drive *drive);

#ifdef __AVR__
/* Timer 1 counts cycles; what takes 2^16 of them or more is told by its flag, and put as 2^32 - 1. */
static uint32_t cycles(uint16_t begin, uint16_t end)
{
    return (TIFR1 & _BV(TOV1)) ? UINT32_MAX : (uint32_t)(end - begin);
}
/* What takes longer is counted in steps of 256, one that is begun is one. */
#define LONG_BEGIN(at) (TCCR1B = 0, TCNT1 = 0, TIFR1 = _BV(TOV1), TCCR1B = _BV(CS12), (at) = TCNT1)
#define LONG_ELAPSED(from, to) ((TIFR1 & _BV(TOV1)) ? UINT32_MAX : ((uint32_t)(uint16_t)((to) - (from)) + 1u) * 256u)
#define PASSED 0u
#define BEGIN(at) (TCCR1B = 0, TCNT1 = 0, TIFR1 = _BV(TOV1), TCCR1B = _BV(CS10), (at) = TCNT1)
#define END(at) ((at) = TCNT1)
#define ELAPSED(from, to) cycles((uint16_t)(from), (uint16_t)(to))
#define RETURN 4u
#define STACK() ((uint8_t *)(uint16_t)(SP + 1u))
__asm(".global only_return\n.type only_return, @function\nonly_return: ret\n");
#else
/* QEMU with `-icount shift=10` lets an instruction take 1024 ns: 25.6 ticks of SysTick at the board's 25 MHz. */
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
#define BEGIN(at) ((at) = SYST_CVR)
#define END(at) ((at) = SYST_CVR)
#define ELAPSED(from, to) (((((from) - (to)) & UINT32_C(0xFFFFFF)) * 5u + 64u) / 128u)
#define LONG_BEGIN(at) BEGIN(at)
#define LONG_ELAPSED(from, to) ELAPSED(from, to)
#ifdef DZ_BLOCK
#define PASSED 4u /* bytes of stack for the last of dz_drive_sample()'s arguments, the fifth */
#else
#define PASSED 0u
#endif
#define RETURN 1u
__asm(".thumb\n.global only_return\n.thumb_func\nonly_return: bx lr\n");
__attribute__((always_inline)) static inline uint8_t *stack_here(void)
{
    uint8_t *place;

    __asm volatile("mov %0, sp" : "=r"(place));
    return place;
}
#define STACK() stack_here()
#endif
uint16_t only_return(void);

/* Paints the stack, counts a call, and looks how far down the paint is gone: what follows is the same machine code for
 * the core's function and for the one that only returns. */
#define TRY_IN(call, begin, elapsed)                                                                                   \
    do {                                                                                                               \
        uint32_t from, to;                                                                                             \
        volatile uint8_t *const top = STACK();                                                                         \
        found[1] = 0u;                                                                                                 \
        for (uint16_t k = 1u; k <= painted; k++) {                                                                     \
            *(top - k) = 0xA5u;                                                                                        \
        }                                                                                                              \
        begin(from);                                                                                                   \
        call;                                                                                                          \
        END(to);                                                                                                       \
        for (uint16_t k = 1u; k <= painted; k++) {                                                                     \
            found[1] = *(top - k) != 0xA5u ? k : found[1];                                                             \
        }                                                                                                              \
        found[0] = elapsed(from, to);                                                                                  \
    } while (0)
#define TRY(call) TRY_IN(call, BEGIN, ELAPSED)

static struct dz_drive drive, unused;
static uint16_t painted; /* painting takes longer than what is counted, so not every call is */
static volatile uint16_t result;

__attribute__((noinline)) static void try_law(uint32_t *found, of_codes called, const uint16_t *code)
{
    TRY(result = called(GIVEN code[0], code[1], code[2]));
}

__attribute__((noinline)) static void try_sample(
    uint32_t *found, of_sample called, struct dz_drive *with, const uint16_t *code)
{
    TRY(called(GIVEN with, code[0], code[1], code[2]));
    found[1] += PASSED;
}

__attribute__((noinline)) static void try_tick(uint32_t *found, of_drive called, struct dz_drive *with)
{
    TRY(called(GIVEN with));
}

/* Least and most counts and the deepest stack, of a call and of the same one of nothing. */
static void keep(uint32_t *kept, const uint32_t *found, const uint32_t *nothing)
{
    const uint32_t count = found[0] - nothing[0] + RETURN;

    kept[0] = count < kept[0] ? count : kept[0];
    kept[1] = count > kept[1] ? count : kept[1];
    kept[2] = found[1] > kept[2] ? found[1] : kept[2];
}

/* Whether there is no fault in three codes, of one sign of command at least. */
static int are_sound(const uint16_t *code)
{
#if BOTH
    if ((dz_status_negative(GIVEN code[0], code[1], code[2]) & ~DZ_STATUS_ABOVE) == 0u) {
        return 1;
    }
#endif
    return (dz_status(GIVEN code[0], code[1], code[2]) & ~DZ_STATUS_ABOVE) == 0u;
}

static void draw(uint16_t *code, uint16_t part, uint16_t first)
{
    static uint32_t random = 1u;
    static uint16_t held;

    do {
        for (uint8_t at = 0u; at < 3u; at++) {
            random = random * UINT32_C(1664525) + UINT32_C(1013904223);
            code[at] = (uint16_t)(random >> 16) % (DZ_ADC_CODE_MAX + 1u);
        }
        if (part == 0u) {
            code[0] = ZERO;
        } else if (part < 3u && first == 0u) {
            code[0] = held;
        }
    } while (part < 3u && (!are_sound(code) || (BOTH && part != 0u && (part == 1u) != (code[0] > ZERO))));
    held = code[0];
}

#ifdef DZ_BLOCK
typedef uint16_t (*of_block)(const struct dz_calibration *block);

__attribute__((noinline)) static void try_check(uint32_t *found, of_block called)
{
    TRY_IN(result = called(&dz_block), LONG_BEGIN, LONG_ELAPSED);
}

/* The most of the check: counts and stack. */
static void keep_check(uint32_t *kept, const uint32_t *found, const uint32_t *nothing)
{
    const uint32_t count = found[0] - nothing[0] + RETURN;

    kept[0] = count > kept[0] ? count : kept[0];
    kept[1] = found[1] > kept[1] ? found[1] : kept[1];
}

/* Whether the firmware takes the block as it stands, but for its CRC. */
static int is_accepted(void)
{
    return (dz_calibration_check(&dz_block) & ~DZ_CALIBRATION_CRC) == 0u;
}

/* Gives a number of the block another value, unless the firmware would not take that. */
#define SET(field, value)                                                                                              \
    do {                                                                                                               \
        const uint32_t before = dz_block.field;                                                                        \
        dz_block.field = (value);                                                                                      \
        if (!is_accepted()) {                                                                                          \
            dz_block.field = before;                                                                                   \
        }                                                                                                              \
    } while (0)

/* An inverse play: codes of travel times those of the transition are a power of two. */
static void play(void)
{
    const uint16_t codes = dz_block.transition_codes, step = dz_block.play_step_shift, shift = dz_block.play_shift;

    if (dz_block.play_codes != 0u) {
        return;
    }
    dz_block.play_codes = 4u;
    dz_block.play_step_shift = 12u;
    dz_block.play_shift = 2u;
    while ((UINT32_C(8) << (dz_block.play_shift - 2u)) <= 4u * (uint32_t)codes) {
        dz_block.play_shift++;
    }
    dz_block.transition_codes = (uint16_t)(1u << (dz_block.play_shift - 2u));
    if (!is_accepted()) {
        dz_block.play_codes = 0u;
        dz_block.play_step_shift = step;
        dz_block.play_shift = shift;
        dz_block.transition_codes = codes;
    }
}

/* Every function on; then the longest shifts, with which the output is low. */
static void harder(uint8_t round)
{
    for (uint8_t side = 0u; side <= BOTH; side++) {
        if (round == 1u) {
            SET(sides[side].ramp_up, 1000000u);
            SET(sides[side].ramp_down, 1000000u);
        } else {
            SET(sides[side].reciprocal_shift, 31u);
        }
    }
    if (round == 1u) {
        SET(ramps, 1u);
        SET(fault_latch, 1u);
        SET(interlock, 40u);
        SET(dither_ticks, 3u);
        SET(dither_counts, 100u);
        play();
    }
}
#endif

static void start(uint32_t (*kept)[3])
{
    for (uint8_t row = 0u; row < 3u; row++) {
        kept[row][0] = UINT32_MAX;
        kept[row][1] = 0u;
        kept[row][2] = 0u;
    }
}

static void show(uint32_t (*kept)[3])
{
    for (uint8_t row = 0u; row < 9u; row++) {
        put(kept[row / 3u][row % 3u]);
    }
}

static void count_calls(uint32_t (*kept)[3], uint16_t calls)
{
    const of_codes core[] = {
        dz_comp,
#if BOTH
        dz_comp_negative,
#endif
    };
    uint32_t found[2], nothing[2];

    for (uint16_t k = 0u; k < calls; k++) {
        const uint16_t part = (k / PART) % 4u;
        uint16_t code[3];

        if (k % (4u * PART) == 0u) {
            dz_drive_init(GIVEN &drive);
        }
        draw(code, part, k % PART == 0u);
        painted = (k % 8u == 0u) ? PAINTED : 0u;
        for (uint8_t side = 0u; side < sizeof core / sizeof core[0]; side++) {
            try_law(nothing, (of_codes)only_return, code);
            try_law(found, core[side], code);
            keep(kept[0], found, nothing);
        }
        try_sample(nothing, (of_sample)only_return, &unused, code);
        try_sample(found, dz_drive_sample, &drive, code);
        keep(kept[1], found, nothing);
        try_tick(nothing, (of_drive)only_return, &unused);
        try_tick(found, dz_drive_tick, &drive);
        keep(kept[2], found, nothing);
    }
}

static void program(void)
{
    uint32_t kept[3][3];

#ifndef __AVR__
    SYST_RVR = UINT32_C(0xFFFFFF);
    SYST_CVR = 0u;
    SYST_CSR = 5u; /* on, processor clock, no interrupt */
#endif
    start(kept);
    count_calls(kept, CALLS);
    show(kept);
    put(sizeof drive);
#ifdef DZ_BLOCK
    uint32_t found[2], nothing[2], of_check[2] = {0u, 0u};

    painted = PAINTED;
    try_check(nothing, (of_block)only_return);
    try_check(found, dz_calibration_check);
    put(result);
    keep_check(of_check, found, nothing);
    start(kept);
    for (uint8_t round = 1u; round <= 2u; round++) {
        harder(round);
        painted = PAINTED;
        try_check(found, dz_calibration_check);
        keep_check(of_check, found, nothing);
        count_calls(kept, CALLS / 2u);
    }
    put(of_check[0]);
    put(of_check[1]);
    show(kept);
#endif
}
