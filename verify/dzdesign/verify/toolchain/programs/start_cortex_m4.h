/* A program on a Cortex-M4 in QEMU: from reset to semihosting's exit; what it puts is semihosting's text. */
#ifndef DZ_MACHINE_H
#define DZ_MACHINE_H

#include <stddef.h>
#include <stdint.h>

extern uint32_t stack_top;

/* What a compiler may call where there is no library; their own loops must not become calls of themselves. */
#define LOOP __attribute__((optimize("no-tree-loop-distribute-patterns")))
void *memcpy(void *to, const void *from, size_t count);
void *memset(void *to, int value, size_t count);
void reset(void);

LOOP void *memcpy(void *to, const void *from, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        ((uint8_t *)to)[k] = ((const uint8_t *)from)[k];
    }
    return to;
}

LOOP void *memset(void *to, int value, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        ((uint8_t *)to)[k] = (uint8_t)value;
    }
    return to;
}

/* One number; all of them stand in one line. */
static void put(uint32_t value)
{
    char digits[12];
    int at = 11;

    digits[at] = '\0';
    digits[--at] = ' ';
    do {
        digits[--at] = (char)('0' + (value % 10u));
        value /= 10u;
    } while (value != 0u);
    __asm volatile("movs r0, #4\n mov r1, %0\n bkpt 0xab" : : "r"(&digits[at]) : "r0", "r1", "memory"); /* SYS_WRITE0 */
}

static void stop(void)
{
    /* SYS_EXIT with ADP_Stopped_ApplicationExit. */
    __asm volatile("movs r0, #0x18\n movw r1, #0x26\n movt r1, #0x2\n bkpt 0xab");
    for (;;) {
    }
}

/* What the program does, written behind this. */
static void program(void);

void reset(void)
{
    program();
    stop();
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    &stack_top, (void *)reset, (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop,
};

#endif
