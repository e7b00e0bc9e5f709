/* The check on an ATmega1280 in simavr, of a sample: the numbers found go to the UART. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#include "every_input.h"

extern const uint8_t DZ_TABLE dz_prepared[];

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
}

int main(void)
{
    struct dz_findings findings;

    UCSR0B = _BV(TXEN0);
    UBRR0 = 0;
    dz_check_sample(dz_prepared, &findings);
    dz_put_findings(&findings, put);
    put_letter('\n');
    cli();
    sleep_enable();
    sleep_cpu(); /* with interrupts off: simavr ends */
    return 0;
}
