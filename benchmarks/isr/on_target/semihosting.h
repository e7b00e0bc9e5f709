/* Text out of QEMU. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

static void put_text(const char *text)
{
    __asm volatile("movs r0, #4\n mov r1, %0\n bkpt 0xab" : : "r"(text) : "r0", "r1", "memory"); /* SYS_WRITE0 */
}

static void put_number(uint32_t value)
{
    char digits[12];
    int at = 11;

    digits[at] = '\0';
    do {
        digits[--at] = (char)('0' + (value % 10u));
        value /= 10u;
    } while (value != 0u);
    digits[--at] = ' ';
    put_text(&digits[at]);
}

#endif
