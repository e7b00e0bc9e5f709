/* A block so small that two copies of it fit an AVR: what the loading asks of one, and nothing of a law. */
#ifndef DZ_CALIBRATION_H
#define DZ_CALIBRATION_H

#include <stdint.h>

#define DZ_CALIBRATION_LAYOUT 1u
#define DZ_CALIBRATION_WORDS 80u
#define DZ_CALIBRATION_SHAPE 0u
#define DZ_ADC_CODE_MAX 4095u
#define DZ_COMPARE_MAX 60000u
#define DZ_SAMPLE_HZ 1250u
#define DZ_TICK_HZ 2500u
#define DZ_BETA_STEP 64u

struct dz_calibration
{
    uint32_t magic;
    uint16_t layout;
    uint16_t length;
    uint16_t compensator_sha256[16];
    uint16_t serial[12];
    uint16_t numbers[46];
    uint32_t crc32;
};

uint16_t dz_calibration_check(const struct dz_calibration *block);

#endif
