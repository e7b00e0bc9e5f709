/* A program on an ATmega1280 in simavr, whose int has 16 bits: what it puts goes to the UART. */
#ifndef DZ_MACHINE_H
#define DZ_MACHINE_H

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#include <stdint.h>

static void put_letter(char letter)
{
    while (!(UCSR0A & _BV(UDRE0))) {
    }
    UDR0 = (uint8_t)letter;
}

/* One number; all of them stand in one line. */
static void put(uint32_t value)
{
    char digits[10];
    uint8_t count = 0;

    do {
        digits[count++] = (char)('0' + (char)(value % 10u));
        value /= 10u;
    } while (value != 0u);
    while (count != 0u) {
        put_letter(digits[--count]);
    }
    put_letter(' ');
}

/* What the program does, written behind this. */
static void program(void);

int main(void)
{
    UCSR0B = _BV(TXEN0);
    UBRR0 = 0;
    program();
    put_letter('\n');
    cli();
    sleep_enable();
    sleep_cpu(); /* with interrupts off: simavr ends */
    return 0;
}

#endif
