/* Host stand-in for TI's DriverLib: only what the firmware calls, each name with the argument types of the F28004x headers.
 * The values are not TI's: each constant has its own, so that a recorded call can be read by name (device.c). */
#ifndef DRIVERLIB_H
#define DRIVERLIB_H

#include <stdbool.h>
#include <stdint.h>

#define __interrupt

/* Lists of constants: X(name, value). All fit a 16-bit int, and no count is among them. */
#define PLAIN_WORDS                                                                                                    \
    X(EPWM1_BASE, 30001) X(ADCA_BASE, 30002) X(ADCARESULT_BASE, 30003) X(INT_EPWM1, 30004)                             \
    X(INTERRUPT_ACK_GROUP3, 30005) X(EPWM_TZ_SIGNAL_OSHT1, 30006) X(EPWM_TZ_FORCE_EVENT_OST, 30007)                    \
    X(EPWM_TZ_FLAG_OST, 30008) X(EPWM_INT_TBCTR_U_CMPB, 30009) X(EPWM_INT_TBCTR_ZERO, 30010)                           \
    X(GPIO_PIN_TYPE_STD, 30011) X(GPIO_PIN_TYPE_PULLUP, 30012) X(GPIO_0_EPWM1_A, 30013) X(GPIO_12_GPIO12, 30014)       \
    X(SYSCTL_CAUSE_WDRS, 30015) X(EPWM2_BASE, 30016) X(GPIO_2_EPWM2_A, 30017)                             \
    X(EPWM_TZ_SIGNAL_OSHT2, 30018) X(GPIO_13_GPIO13, 30019)
#define TYPED_WORDS                                                                                                    \
    T(EPWM_ClockDivider, X(EPWM_CLOCK_DIVIDER_1, 30101))                                                               \
    T(EPWM_HSClockDivider, X(EPWM_HSCLOCK_DIVIDER_1, 30111))                                                           \
    T(EPWM_PeriodLoadMode, X(EPWM_PERIOD_SHADOW_LOAD, 30121))                                                          \
    T(EPWM_TimeBaseCountMode, X(EPWM_COUNTER_MODE_UP, 30131) X(EPWM_COUNTER_MODE_UP_DOWN, 30132))                      \
    T(EPWM_CounterCompareModule, X(EPWM_COUNTER_COMPARE_A, 30141) X(EPWM_COUNTER_COMPARE_B, 30142))                    \
    T(EPWM_CounterCompareLoadMode, X(EPWM_COMP_LOAD_ON_CNTR_ZERO, 30151))                                              \
    T(EPWM_ActionQualifierOutputModule, X(EPWM_AQ_OUTPUT_A, 30161))                                                    \
    T(EPWM_ActionQualifierOutput, X(EPWM_AQ_OUTPUT_LOW, 30171) X(EPWM_AQ_OUTPUT_HIGH, 30172))                          \
    T(EPWM_ActionQualifierOutputEvent,                                                                                 \
      X(EPWM_AQ_OUTPUT_ON_TIMEBASE_ZERO, 30181) X(EPWM_AQ_OUTPUT_ON_TIMEBASE_UP_CMPA, 30182))                          \
    T(EPWM_ActionQualifierSWOutput, X(EPWM_AQ_SW_DISABLED, 30191) X(EPWM_AQ_SW_OUTPUT_LOW, 30192))                     \
    T(EPWM_ActionQualifierContForce, X(EPWM_AQ_SW_SH_LOAD_ON_CNTR_ZERO, 30201))                                        \
    T(EPWM_ADCStartOfConversionType, X(EPWM_SOC_A, 30211))                                                             \
    T(EPWM_ADCStartOfConversionSource, X(EPWM_SOC_TBCTR_ZERO, 30221) X(EPWM_SOC_TBCTR_U_CMPA, 30222))                  \
    T(EPWM_TripZoneEvent, X(EPWM_TZ_ACTION_EVENT_TZA, 30231))                                                          \
    T(EPWM_TripZoneAction, X(EPWM_TZ_ACTION_LOW, 30241) X(EPWM_TZ_ACTION_HIGH, 30242))                                 \
    T(XBAR_InputNum, X(XBAR_INPUT1, 30251) X(XBAR_INPUT2, 30252))                                                      \
    T(ADC_ReferenceMode, X(ADC_REFERENCE_INTERNAL, 30261))                                                             \
    T(ADC_ReferenceVoltage, X(ADC_REFERENCE_3_3V, 30271))                                                              \
    T(ADC_ClkPrescale, X(ADC_CLK_DIV_2_0, 30281))                                                                      \
    T(ADC_PulseMode, X(ADC_PULSE_END_OF_CONV, 30291))                                                                  \
    T(ADC_Trigger, X(ADC_TRIGGER_EPWM1_SOCA, 30301) X(ADC_TRIGGER_EPWM2_SOCA, 30302) X(ADC_TRIGGER_SW_ONLY, 30303))    \
    T(ADC_Channel, X(ADC_CH_ADCIN0, 30311) X(ADC_CH_ADCIN1, 30312) X(ADC_CH_ADCIN2, 30313) X(ADC_CH_ADCIN3, 30314) X(ADC_CH_ADCIN4, 30315))\
    T(ADC_IntNumber, X(ADC_INT_NUMBER1, 30321) X(ADC_INT_NUMBER2, 30322))                                              \
    T(ADC_SOCNumber, X(ADC_SOC_NUMBER0, 0) X(ADC_SOC_NUMBER1, 1) X(ADC_SOC_NUMBER2, 2) X(ADC_SOC_NUMBER3, 3)           \
      X(ADC_SOC_NUMBER8, 8) X(ADC_SOC_NUMBER9, 9) X(ADC_SOC_NUMBER10, 10) X(ADC_SOC_NUMBER11, 11)                      \
      X(ADC_SOC_NUMBER12, 12) X(ADC_SOC_NUMBER13, 13) X(ADC_SOC_NUMBER14, 14) X(ADC_SOC_NUMBER15, 15)) /* plain too */ \
    T(ADC_PriorityMode, X(ADC_PRI_THRU_SOC7_HIPRI, 30331))                                                             \
    T(EPWM_SyncOutPulseMode, X(EPWM_SYNC_OUT_PULSE_ON_COUNTER_ZERO, 30401))                                            \
    T(GPIO_Direction, X(GPIO_DIR_MODE_IN, 30341))                                                                      \
    T(GPIO_QualificationMode, X(GPIO_QUAL_ASYNC, 30351))                                                               \
    T(SysCtl_PeripheralPCLOCKCR, X(SYSCTL_PERIPH_CLK_TBCLKSYNC, 30361))                                                \
    T(SysCtl_WDMode, X(SYSCTL_WD_MODE_RESET, 30371))                                                                   \
    T(SysCtl_WDPredivider, X(SYSCTL_WD_PREDIV_512, 30381))                                                             \
    T(SysCtl_WDPrescaler, X(SYSCTL_WD_PRESCALE_1, 30391))

#define X(name, value) name = (value),
#define T(type, names) typedef enum { names } type;
enum plain_words { PLAIN_WORDS };
TYPED_WORDS
#undef X
#undef T

void EPWM_setClockPrescaler(uint32_t base, EPWM_ClockDivider prescaler, EPWM_HSClockDivider high_speed);
void EPWM_setPeriodLoadMode(uint32_t base, EPWM_PeriodLoadMode mode);
void EPWM_setTimeBasePeriod(uint32_t base, uint16_t count);
void EPWM_setTimeBaseCounter(uint32_t base, uint16_t count);
void EPWM_disablePhaseShiftLoad(uint32_t base);
void EPWM_setTimeBaseCounterMode(uint32_t base, EPWM_TimeBaseCountMode mode);
void EPWM_setCounterCompareShadowLoadMode(uint32_t base, EPWM_CounterCompareModule module,
                                          EPWM_CounterCompareLoadMode mode);
void EPWM_setCounterCompareValue(uint32_t base, EPWM_CounterCompareModule module, uint16_t count);
void EPWM_setActionQualifierAction(uint32_t base, EPWM_ActionQualifierOutputModule module,
                                   EPWM_ActionQualifierOutput output, EPWM_ActionQualifierOutputEvent event);
void EPWM_setActionQualifierContSWForceShadowMode(uint32_t base, EPWM_ActionQualifierContForce mode);
void EPWM_setActionQualifierContSWForceAction(uint32_t base, EPWM_ActionQualifierOutputModule module,
                                              EPWM_ActionQualifierSWOutput output);
void EPWM_setADCTriggerSource(uint32_t base, EPWM_ADCStartOfConversionType type,
                              EPWM_ADCStartOfConversionSource source);
void EPWM_setADCTriggerEventPrescale(uint32_t base, EPWM_ADCStartOfConversionType type, uint16_t count);
void EPWM_enableADCTrigger(uint32_t base, EPWM_ADCStartOfConversionType type);
void EPWM_setInterruptSource(uint32_t base, uint16_t source);
void EPWM_setInterruptEventCount(uint32_t base, uint16_t count);
void EPWM_enableInterrupt(uint32_t base);
void EPWM_clearEventTriggerInterruptFlag(uint32_t base);
void EPWM_setTripZoneAction(uint32_t base, EPWM_TripZoneEvent event, EPWM_TripZoneAction action);
void EPWM_enableTripZoneSignals(uint32_t base, uint16_t signals);
void EPWM_forceTripZoneEvent(uint32_t base, uint16_t event);
void EPWM_clearTripZoneFlag(uint32_t base, uint16_t flags);
uint16_t EPWM_getTripZoneFlagStatus(uint32_t base);

void EPWM_setSyncOutPulseMode(uint32_t base, EPWM_SyncOutPulseMode mode);
void EPWM_setPhaseShift(uint32_t base, uint16_t phaseCount);
void EPWM_enablePhaseShiftLoad(uint32_t base);
void EPWM_disableCounterCompareShadowLoadMode(uint32_t base, EPWM_CounterCompareModule module);

void ADC_setSOCPriority(uint32_t base, ADC_PriorityMode mode);
void ADC_setBurstModeConfig(uint32_t base, ADC_Trigger trigger, uint16_t size);
void ADC_enableBurstMode(uint32_t base);
void ADC_setVREF(uint32_t base, ADC_ReferenceMode mode, ADC_ReferenceVoltage voltage);
void ADC_setPrescaler(uint32_t base, ADC_ClkPrescale prescale);
void ADC_setInterruptPulseMode(uint32_t base, ADC_PulseMode mode);
void ADC_enableConverter(uint32_t base);
void ADC_setupSOC(uint32_t base, ADC_SOCNumber number, ADC_Trigger trigger, ADC_Channel channel, uint32_t window);
void ADC_setInterruptSource(uint32_t base, ADC_IntNumber number, uint16_t trigger);
void ADC_disableContinuousMode(uint32_t base, ADC_IntNumber number);
void ADC_enableInterrupt(uint32_t base, ADC_IntNumber number);
void ADC_clearInterruptStatus(uint32_t base, ADC_IntNumber number);
bool ADC_getInterruptStatus(uint32_t base, ADC_IntNumber number);
bool ADC_getInterruptOverflowStatus(uint32_t base, ADC_IntNumber number);
void ADC_clearInterruptOverflowStatus(uint32_t base, ADC_IntNumber number);
bool ADC_isBusy(uint32_t base);
uint16_t ADC_readResult(uint32_t base, ADC_SOCNumber number);

void GPIO_setDirectionMode(uint32_t pin, GPIO_Direction direction);
void GPIO_setPadConfig(uint32_t pin, uint32_t type);
void GPIO_setQualificationMode(uint32_t pin, GPIO_QualificationMode mode);
void GPIO_setPinConfig(uint32_t config);
uint32_t GPIO_readPin(uint32_t pin);
void XBAR_setInputPin(XBAR_InputNum input, uint16_t pin);

void Interrupt_initModule(void);
void Interrupt_initVectorTable(void);
void Interrupt_register(uint32_t number, void (*handler)(void));
void Interrupt_enable(uint32_t number);
void Interrupt_clearACKGroup(uint16_t group);

void SysCtl_disablePeripheral(SysCtl_PeripheralPCLOCKCR peripheral);
void SysCtl_enablePeripheral(SysCtl_PeripheralPCLOCKCR peripheral);
uint32_t SysCtl_getResetCause(void);
bool SysCtl_isMCDClockFailureDetected(void);
uint32_t SysCtl_getClock(uint32_t oscillator_hz);
void SysCtl_setWatchdogMode(SysCtl_WDMode mode);
void SysCtl_setWatchdogPredivider(SysCtl_WDPredivider predivider);
void SysCtl_setWatchdogPrescaler(SysCtl_WDPrescaler prescaler);
void SysCtl_serviceWatchdog(void);
void SysCtl_enableWatchdog(void);

/* Of cpu.h */
void device_dint(void);
void device_eint(void);
#define DINT device_dint()
#define EINT device_eint()

#endif
