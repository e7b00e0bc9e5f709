/* Host stand-in for the generated core in block form: what comes out tells whose block went in. */
#ifndef DZ_COMP_H
#define DZ_COMP_H

#include "dz_calibration.h"

uint16_t dz_status(const struct dz_calibration *block, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_beta(const struct dz_calibration *block, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_status_negative(const struct dz_calibration *block, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_beta_negative(const struct dz_calibration *block, uint16_t p_a_adc, uint16_t p_b_adc);

#endif
