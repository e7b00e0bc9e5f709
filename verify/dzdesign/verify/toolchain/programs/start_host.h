/* A program on the host, by itself: one that crashes ends nothing else. */
#ifndef DZ_MACHINE_H
#define DZ_MACHINE_H

#include <stdint.h>
#include <stdio.h>

/* One number; all of them stand in one line. */
static void put(uint32_t value)
{
    printf("%lu ", (unsigned long)value);
}

/* What the program does, written behind this. */
static void program(void);

int main(void)
{
    program();
    printf("\n");
    return 0;
}

#endif
