/* Takes the octets of stream.h as they come from a line and prints every reply, then what both slots hold: the same on a
 * host and on an AVR, whose int has 16 bits as the C28x's. */
#include <stdio.h>
#include <string.h>

#include "dz_load.h"
#include "stream.h"

#ifdef __AVR__
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>

static int put(char octet, FILE *file)
{
    (void)file;
    while ((UCSR0A & _BV(UDRE0)) == 0)
    {
    }
    UDR0 = (uint8_t)octet;
    return 0;
}

static FILE uart = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);
#define OCTET(at) pgm_read_byte(&stream[at])
#else
#define OCTET(at) stream[at]
#endif

static struct dz_load load;
static struct dz_calibration linked;
static uint16_t hold;

uint16_t dz_calibration_check(const struct dz_calibration *block)
{
    return (block->length == DZ_CALIBRATION_WORDS) ? 0u : 1u;
}

uint16_t dz_load_refusal(const struct dz_calibration *block)
{
    (void)block;
    return 0u;
}

uint16_t dz_load_hold(uint16_t wanted)
{
    hold = wanted;
    return hold;
}

void dz_load_use(const struct dz_calibration *block) { printf("use %u\n", (unsigned)(block->serial[0])); }

static void print(const uint16_t *numbers, uint16_t count)
{
    for (uint16_t i = 0u; i < count; i++)
    {
        printf("%04X", (unsigned)numbers[i]);
        if ((i % 48u) == 47u)
        {
            printf("\n"); /* simavr cuts lines of more than 255 characters */
        }
    }
    printf("\n");
}

int main(void)
{
    uint16_t ticks = 65000u; /* goes round on the way */

#ifdef __AVR__
    UCSR0B = _BV(TXEN0);
    stdout = &uart;
#endif
    dz_store_init();
    dz_load_init(&load, &linked);
    for (uint16_t i = 0u; i < sizeof stream; i++)
    {
        dz_load_receive(&load.receiver, OCTET(i), ticks);
        ticks = (uint16_t)(ticks + ((i % 3u == 0u) ? 1u : 0u));
        for (uint16_t passes = 0u; passes < 3u; passes++)
        {
            dz_load_poll(&load, ticks);
            if (load.reply_octets != 0u)
            {
                print(load.reply, load.reply_octets);
                load.reply_octets = 0u;
            }
        }
    }
    for (uint16_t slot = 0u; slot < DZ_STORE_SLOTS; slot++)
    {
        uint16_t words[DZ_CALIBRATION_WORDS + 1u];

        memcpy(words, dz_store_slot(slot), sizeof words);
        for (uint16_t at = 0u; at < DZ_CALIBRATION_WORDS; at = (uint16_t)(at + 40u))
        {
            print(&words[at], 40u);
        }
        print(&words[DZ_CALIBRATION_WORDS], 1u);
    }
    printf("used %u bad %u held %u end\n", (unsigned)load.used, (unsigned)load.receiver.bad, (unsigned)hold);
#ifdef __AVR__
    cli();
    sleep_mode();
#endif
    return 0;
}
