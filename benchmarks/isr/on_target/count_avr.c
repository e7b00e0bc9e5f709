/* Cycles of one call: of a function that only returns, and of dz_comp; then what dz_comp gave. On the UART.
 *
 * Timer 1 counts cycles and wraps at 2^16; timer 3 counts every 64th and tells how often.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#include "inputs.h"

typedef uint16_t (*isr_core)(uint16_t, uint16_t, uint16_t);
uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t only_return(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
__asm(".global only_return\n.type only_return, @function\nonly_return: ret\n");

static volatile uint16_t result;

static void put(char letter)
{
    while (!(UCSR0A & _BV(UDRE0))) {
    }
    UDR0 = (uint8_t)letter;
}

static void put_number(uint32_t value)
{
    char digits[10];
    uint8_t count = 0;

    do {
        digits[count++] = (char)('0' + (char)(value % 10u));
        value /= 10u;
    } while (value != 0u);
    while (count != 0u) {
        put(digits[--count]);
    }
    put(' ');
}

__attribute__((noinline)) static uint32_t cycles(isr_core core, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    uint16_t start, end, coarse;

    TCCR1B = 0;
    TCCR3B = 0;
    TCNT1 = 0;
    TCNT3 = 0;
    TCCR3B = _BV(CS31) | _BV(CS30);
    TCCR1B = _BV(CS10);
    start = TCNT1;
    result = core(u_adc, p_a_adc, p_b_adc);
    end = TCNT1;
    coarse = TCNT3;
    end = (uint16_t)(end - start);
    return end + ((UINT32_C(64) * coarse - end + UINT32_C(0x8000)) & UINT32_C(0xFFFF0000));
}

int main(void)
{
    UCSR0B = _BV(TXEN0);
    UBRR0 = 0;
    for (int16_t i = 0; i < INPUT_COUNT; i++) {
        const uint16_t u = input(i, 0), p_a = input(i, 1), p_b = input(i, 2);

        put_number(cycles(only_return, u, p_a, p_b));
        put_number(cycles(dz_comp, u, p_a, p_b));
        put_number(result);
        put('\n');
    }
    cli();
    sleep_enable();
    sleep_cpu(); /* with interrupts off: simavr ends */
    return 0;
}
