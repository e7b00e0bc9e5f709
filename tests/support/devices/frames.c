/* Writes frames of the generated dz_frame.c, and what may happen to them on a line, as lines of stdin say:
 *
 *   frame NUMBERS      the frame of these numbers, in the order of struct dz_frame
 *   cut N NUMBERS      its first N octets
 *   flip N NUMBERS     the frame with the lowest bit of octet N changed
 *   raw HEX            these octets
 */
#include <stdio.h>
#include <string.h>

#include "dz_frame.h"

static void put(const uint16_t *octets, unsigned count)
{
    unsigned i;
    for (i = 0u; i < count; i++)
    {
        putchar((int)octets[i]);
    }
    fflush(stdout);
}

static int frame_of(const char *text, uint16_t *octets)
{
    unsigned n[10];
    struct dz_frame frame;

    if (sscanf(text, "%u %u %u %u %u %u %u %u %u %u", n, n + 1, n + 2, n + 3, n + 4, n + 5, n + 6, n + 7, n + 8, n + 9)
        != 10)
    {
        return 0;
    }
    frame.ticks = (uint32_t)n[0];
    frame.origin = (uint16_t)n[1];
    frame.u_adc = (uint16_t)n[2];
    frame.p_a_adc = (uint16_t)n[3];
    frame.p_b_adc = (uint16_t)n[4];
    frame.p_c_adc = (uint16_t)n[5];
    frame.beta = (uint16_t)n[6];
    frame.compare_a = (uint16_t)n[7];
    frame.compare_b = (uint16_t)n[8];
    frame.status = (uint16_t)n[9];
    dz_frame_pack(&frame, octets);
    return 1;
}

static void put_hex(const char *text)
{
    unsigned octet;
    for (; sscanf(text, "%2x", &octet) == 1; text += 2)
    {
        putchar((int)octet);
    }
    fflush(stdout);
}

int main(void)
{
    char line[400];
    char word[8];
    int used;
    unsigned n;
    uint16_t octets[DZ_FRAME_OCTETS];

    while (fgets(line, sizeof line, stdin) != NULL)
    {
        if (sscanf(line, "%7s %n", word, &used) != 1)
        {
            return 1;
        }
        if (strcmp(word, "raw") == 0)
        {
            put_hex(line + used);
        }
        else if ((strcmp(word, "frame") == 0) && frame_of(line + used, octets))
        {
            put(octets, DZ_FRAME_OCTETS);
        }
        else if (sscanf(line, "%*s %u %n", &n, &used) == 1 && (n < DZ_FRAME_OCTETS) && frame_of(line + used, octets))
        {
            octets[n] ^= (strcmp(word, "flip") == 0) ? 1u : 0u;
            put(octets, (strcmp(word, "cut") == 0) ? n : DZ_FRAME_OCTETS);
        }
        else
        {
            return 1;
        }
    }
    return 0;
}
