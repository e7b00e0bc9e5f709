/* The format and the CRC of a block: what of dz_calibration_check() the loading relies on. */
#include "dz_calibration.h"

#define CRC_OCTETS 4u

uint16_t dz_calibration_check(const struct dz_calibration *block)
{
    const unsigned char *const octets = (const unsigned char *)block;
    uint16_t wrong = 0u;
    uint32_t crc = 0xFFFFFFFFu;

    for (unsigned i = 0u; i < sizeof *block - CRC_OCTETS; i++)
    {
        crc ^= octets[i];
        for (unsigned bit = 0u; bit < 8u; bit++)
        {
            crc = (crc >> 1) ^ (((crc & 1u) != 0u) ? 0xEDB88320u : 0u);
        }
    }
    wrong |= (uint16_t)((block->magic != DZ_CALIBRATION_MAGIC) || (block->layout != DZ_CALIBRATION_LAYOUT) ||
                                (block->length != DZ_CALIBRATION_WORDS)
                            ? DZ_CALIBRATION_FORMAT
                            : 0u);
    wrong |= (uint16_t)((block->crc32 != ~crc) ? DZ_CALIBRATION_CRC : 0u);
    wrong |= (uint16_t)((block->shape != DZ_CALIBRATION_SHAPE) ? DZ_CALIBRATION_FIRMWARE : 0u);
    wrong |= (uint16_t)((block->sides[0].span > DZ_ADC_CODE_MAX) ? DZ_CALIBRATION_LAW : 0u);
    return wrong;
}
