/* Hashes of blocks of states on an ATmega1280 in simavr, whose int has 16 bits: to the UART. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#include <stddef.h>

#include "current_states.h"

static void put_letter(char letter)
{
    while (!(UCSR0A & _BV(UDRE0))) {
    }
    UDR0 = (uint8_t)letter;
}

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
    put_letter('\n');
}

int main(void)
{
    UCSR0B = _BV(TXEN0);
    UBRR0 = 0;
    for (uint32_t block = 0u; block < BLOCKS; block++) {
        put(current_states(block + SEED, BLOCK, NULL));
    }
    put(current_offsets(SEED, OFFSETS, NULL, NULL));
    cli();
    sleep_enable();
    sleep_cpu(); /* with interrupts off: simavr ends */
    return 0;
}
