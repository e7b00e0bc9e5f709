/* In the place of TI's DriverLib: what the firmware calls, each name with the argument types of the F28004x headers. The
 * values are not TI's. */
#ifndef DRIVERLIB_H
#define DRIVERLIB_H

#include <stdbool.h>
#include <stdint.h>

#define __interrupt

#define EPWM_MODULES 8u
/* A name for each module, X-BAR input, start of conversion and channel; a pin's function is 16 times the pin and more. */
#define EIGHT(X) X(1) X(2) X(3) X(4) X(5) X(6) X(7) X(8)
#define SIXTEEN(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7) X(8) X(9) X(10) X(11) X(12) X(13) X(14) X(15)
#define PINS(X)                                                                                                      \
    SIXTEEN(X) X(16) X(17) X(18) X(20) X(21) X(22) X(23) X(24) X(25) X(26) X(27) X(28) X(29) X(30) X(31) X(32) X(33)  \
    X(34) X(35) X(37) X(39) X(40) X(41) X(42) X(43) X(44) X(45) X(46) X(47) X(48) X(49) X(50) X(51) X(52) X(53) X(54) \
    X(55) X(56) X(57) X(58) X(59)

#define X(n) EPWM##n##_BASE = 30000 + n,
enum pwm_bases { EIGHT(X) };
#undef X
#define X(n) INT_EPWM##n = 30100 + n,
enum pwm_interrupts { EIGHT(X) };
#undef X
#define X(n) GPIO_##n##_GPIO##n = 16 * n,
enum pins_as_such { PINS(X) };
#undef X
#define PIN_OF_PWM 1
enum pins_of_pwm
{
    GPIO_0_EPWM1_A = 1, GPIO_2_EPWM2_A = 33, GPIO_4_EPWM3_A = 65, GPIO_6_EPWM4_A = 97,
    GPIO_8_EPWM5_A = 129, GPIO_10_EPWM6_A = 161, GPIO_12_EPWM7_A = 193, GPIO_14_EPWM8_A = 225
};
enum plain_words
{
    ADCA_BASE = 31001, ADCARESULT_BASE, INTERRUPT_ACK_GROUP3, SYSCTL_CAUSE_WDRS = 8, EPWM_TZ_FORCE_EVENT_OST = 4,
    EPWM_TZ_FLAG_OST = 4, EPWM_TZ_SIGNAL_OSHT1 = 0x100, EPWM_TZ_SIGNAL_OSHT2 = 0x200, EPWM_TZ_SIGNAL_OSHT3 = 0x400,
    EPWM_TZ_SIGNAL_OSHT4 = 0x800, EPWM_TZ_SIGNAL_OSHT5 = 0x1000, EPWM_TZ_SIGNAL_OSHT6 = 0x2000,
    EPWM_INT_TBCTR_ZERO = 1, EPWM_INT_TBCTR_PERIOD = 2, EPWM_INT_TBCTR_U_CMPA = 4, EPWM_INT_TBCTR_U_CMPB = 6,
    GPIO_PIN_TYPE_STD = 0, GPIO_PIN_TYPE_PULLUP, GPIO_PIN_TYPE_INVERT
};
typedef enum { EPWM_CLOCK_DIVIDER_1, EPWM_CLOCK_DIVIDER_2, EPWM_CLOCK_DIVIDER_4 } EPWM_ClockDivider;
typedef enum { EPWM_HSCLOCK_DIVIDER_1, EPWM_HSCLOCK_DIVIDER_2, EPWM_HSCLOCK_DIVIDER_4 } EPWM_HSClockDivider;
typedef enum { EPWM_PERIOD_SHADOW_LOAD, EPWM_PERIOD_DIRECT_LOAD } EPWM_PeriodLoadMode;
typedef enum
{
    EPWM_COUNTER_MODE_UP, EPWM_COUNTER_MODE_DOWN, EPWM_COUNTER_MODE_UP_DOWN, EPWM_COUNTER_MODE_STOP_FREEZE
} EPWM_TimeBaseCountMode;
typedef enum { EPWM_COUNTER_COMPARE_A, EPWM_COUNTER_COMPARE_B } EPWM_CounterCompareModule;
typedef enum { EPWM_COMP_LOAD_ON_CNTR_ZERO, EPWM_COMP_LOAD_ON_CNTR_PERIOD } EPWM_CounterCompareLoadMode;
typedef enum { EPWM_AQ_OUTPUT_A, EPWM_AQ_OUTPUT_B } EPWM_ActionQualifierOutputModule;
typedef enum
{
    EPWM_AQ_OUTPUT_NO_CHANGE, EPWM_AQ_OUTPUT_LOW, EPWM_AQ_OUTPUT_HIGH, EPWM_AQ_OUTPUT_TOGGLE
} EPWM_ActionQualifierOutput;
typedef enum
{
    EPWM_AQ_OUTPUT_ON_TIMEBASE_ZERO = 1, EPWM_AQ_OUTPUT_ON_TIMEBASE_PERIOD = 2, EPWM_AQ_OUTPUT_ON_TIMEBASE_UP_CMPA = 4,
    EPWM_AQ_OUTPUT_ON_TIMEBASE_DOWN_CMPA = 5, EPWM_AQ_OUTPUT_ON_TIMEBASE_UP_CMPB = 6
} EPWM_ActionQualifierOutputEvent;
typedef enum { EPWM_AQ_SW_DISABLED, EPWM_AQ_SW_OUTPUT_LOW, EPWM_AQ_SW_OUTPUT_HIGH } EPWM_ActionQualifierSWOutput;
typedef enum { EPWM_AQ_SW_SH_LOAD_ON_CNTR_ZERO, EPWM_AQ_SW_IMMEDIATE_LOAD = 3 } EPWM_ActionQualifierContForce;
typedef enum { EPWM_SOC_A, EPWM_SOC_B } EPWM_ADCStartOfConversionType;
typedef enum { EPWM_SOC_TBCTR_ZERO = 1, EPWM_SOC_TBCTR_PERIOD = 2, EPWM_SOC_TBCTR_U_CMPA = 4 } EPWM_ADCStartOfConversionSource;
typedef enum { EPWM_TZ_ACTION_EVENT_TZA, EPWM_TZ_ACTION_EVENT_TZB } EPWM_TripZoneEvent;
typedef enum { EPWM_TZ_ACTION_HIGH_Z, EPWM_TZ_ACTION_HIGH, EPWM_TZ_ACTION_LOW, EPWM_TZ_ACTION_DISABLE } EPWM_TripZoneAction;
typedef enum { EPWM_SYNC_OUT_PULSE_ON_EPWMxSYNCIN, EPWM_SYNC_OUT_PULSE_ON_COUNTER_ZERO } EPWM_SyncOutPulseMode;
#define X(n) XBAR_INPUT##n = n - 1,
typedef enum { EIGHT(X) } XBAR_InputNum;
#undef X
#define X(n) ADC_SOC_NUMBER##n = n,
typedef enum { SIXTEEN(X) } ADC_SOCNumber;
#undef X
#define X(n) ADC_CH_ADCIN##n = n,
typedef enum { SIXTEEN(X) } ADC_Channel;
#undef X
#define X(n) ADC_TRIGGER_EPWM##n##_SOCA = 32 + 2 * n, ADC_TRIGGER_EPWM##n##_SOCB,
typedef enum { ADC_TRIGGER_SW_ONLY, EIGHT(X) } ADC_Trigger;
#undef X
typedef enum { ADC_REFERENCE_INTERNAL, ADC_REFERENCE_EXTERNAL } ADC_ReferenceMode;
typedef enum { ADC_REFERENCE_3_3V, ADC_REFERENCE_2_5V } ADC_ReferenceVoltage;
typedef enum { ADC_CLK_DIV_1_0 = 1, ADC_CLK_DIV_2_0, ADC_CLK_DIV_3_0, ADC_CLK_DIV_4_0 } ADC_ClkPrescale;
typedef enum { ADC_PULSE_END_OF_ACQ_WIN, ADC_PULSE_END_OF_CONV } ADC_PulseMode;
typedef enum { ADC_INT_NUMBER1, ADC_INT_NUMBER2 } ADC_IntNumber;
typedef enum { ADC_PRI_ALL_ROUND_ROBIN, ADC_PRI_THRU_SOC7_HIPRI = 8 } ADC_PriorityMode;
typedef enum { GPIO_DIR_MODE_IN, GPIO_DIR_MODE_OUT } GPIO_Direction;
typedef enum { GPIO_QUAL_SYNC, GPIO_QUAL_ASYNC = 3 } GPIO_QualificationMode;
typedef enum { SYSCTL_PERIPH_CLK_TBCLKSYNC = 1 } SysCtl_PeripheralPCLOCKCR;
typedef enum { SYSCTL_WD_MODE_RESET, SYSCTL_WD_MODE_INTERRUPT } SysCtl_WDMode;
typedef enum { SYSCTL_WD_PREDIV_512 = 512, SYSCTL_WD_PREDIV_1024 = 1024, SYSCTL_WD_PREDIV_2048 = 2048, SYSCTL_WD_PREDIV_4096 = 4096 } SysCtl_WDPredivider;
typedef enum
{
    SYSCTL_WD_PRESCALE_1 = 1, SYSCTL_WD_PRESCALE_2 = 2, SYSCTL_WD_PRESCALE_4 = 4, SYSCTL_WD_PRESCALE_8 = 8,
    SYSCTL_WD_PRESCALE_16 = 16, SYSCTL_WD_PRESCALE_32 = 32, SYSCTL_WD_PRESCALE_64 = 64
} SysCtl_WDPrescaler;

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
