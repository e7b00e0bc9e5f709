/* In the place of the core: a sum whose weights show which code came in which place. */
#ifndef DZ_COMP_H
#define DZ_COMP_H

#include <stdint.h>

#ifdef F28335
#define DZ_COMPARE_MAX 60000u
#else
#define DZ_COMPARE_MAX 40000u
#endif
#define DZ_ADC_CODE_MAX 4095u

uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_status(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_beta(uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_status_negative(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);
uint16_t dz_beta_negative(uint16_t p_a_adc, uint16_t p_b_adc);

#endif
