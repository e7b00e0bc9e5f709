/* The check of blocks and the block as C of a firmware, and its block as octets, the file that is the argument.
 *
 * Prints: octets of a block in the C, octets in the file; what the check finds in the file and in the block as C; octets
 * in which the two differ; then how many damaged blocks were tried and how many of them the check accepts: one bit in
 * each octet, and each word of the header with a CRC that is right again; last the 32 octets of the compensator's hash.
 */
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "dz_block.h"

#define LENGTH sizeof(struct dz_calibration)
#define WORD(member) offsetof(struct dz_calibration, member)

static struct dz_calibration block;
static unsigned char sound[LENGTH];

static const size_t header[] = {
    WORD(magic), WORD(magic) + 2u, WORD(layout), WORD(length), WORD(shape), WORD(code_max), WORD(compare_max),
    WORD(sample_Hz), WORD(tick_Hz), WORD(beta_step),
};
static const unsigned changes[] = {0x0001u, 0x0100u, 0x8000u, 0xFFFFu};

/* The check of these octets. */
static unsigned found(const unsigned char *octets)
{
    memcpy(&block, octets, LENGTH);
    return dz_calibration_check(&block);
}

/* CRC-32, reflected, over all octets before it. */
static void set_crc(unsigned char *octets)
{
    unsigned long crc = 0xFFFFFFFFul;
    size_t at;

    for (at = 0u; at < WORD(crc32); at++) {
        int bit;

        crc ^= octets[at];
        for (bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ (((crc & 1ul) != 0ul) ? 0xEDB88320ul : 0ul);
        }
    }
    crc ^= 0xFFFFFFFFul;
    for (at = 0u; at < 4u; at++) {
        octets[WORD(crc32) + at] = (unsigned char)(crc >> (8u * at));
    }
}

int main(int count, char **words)
{
    unsigned long tried = 0ul, accepted = 0ul, header_tried = 0ul, header_accepted = 0ul, differ = 0ul;
    unsigned char octets[LENGTH], linked[LENGTH];
    FILE *file = (count > 1) ? fopen(words[1], "rb") : NULL;
    size_t size, at, i;

    if (file == NULL) {
        return 1;
    }
    size = fread(sound, 1u, LENGTH, file);
    size += (fgetc(file) != EOF) ? 1u : 0u;
    fclose(file);
    printf("%lu %lu\n", (unsigned long)LENGTH, (unsigned long)size);
    memcpy(linked, &dz_block, LENGTH);
    for (at = 0u; at < LENGTH; at++) {
        differ += (linked[at] != sound[at]) ? 1ul : 0ul;
    }
    printf("%u %u %lu\n", found(sound), found(linked), differ);
    for (at = 0u; at < LENGTH; at++) {
        memcpy(octets, sound, LENGTH);
        octets[at] = (unsigned char)(octets[at] ^ (1u << (at % 8u)));
        tried++;
        accepted += (found(octets) == 0u) ? 1ul : 0ul;
    }
    for (i = 0u; i < sizeof header / sizeof header[0]; i++) {
        for (at = 0u; at < sizeof changes / sizeof changes[0]; at++) {
            memcpy(octets, sound, LENGTH);
            octets[header[i]] = (unsigned char)(octets[header[i]] ^ (changes[at] & 0xFFu));
            octets[header[i] + 1u] = (unsigned char)(octets[header[i] + 1u] ^ (changes[at] >> 8));
            set_crc(octets);
            header_tried++;
            header_accepted += (found(octets) == 0u) ? 1ul : 0ul;
        }
    }
    memcpy(octets, sound, LENGTH);
    set_crc(octets);
    printf("%lu %lu %lu %lu %u\n", tried, accepted, header_tried, header_accepted,
           (memcmp(octets, sound, LENGTH) == 0) ? 1u : 0u);
    for (at = 0u; at < 32u; at++) {
        printf("%u%c", sound[WORD(compensator_sha256) + at], (at < 31u) ? ' ' : '\n');
    }
    return 0;
}
