/* A model of what the firmware uses of the F280049C, behind the DriverLib stand-in. Every call is printed while
 * `device_verbose` is set; device_period() is one PWM period: CTR = 0, conversions, then the interrupt at CMPB. */
#include "device.h"

#include <stdarg.h>
#include <stdio.h>

#include "../solenoid.h"
#include "driverlib.h"
#include "model.h"

#define SYSCLK_HZ 100e6
#define FULL_V 3.3
#define WINDOW 50u /* counts from a start to the hold, then to the result */
#define CONVERSION 24u

int device_verbose;
void (*device_on_eint)(void);
void (*device_on_service)(void);
struct model model;
int device_side = 1;

static const char *name_of(uint32_t value)
{
    switch (value)
    {
#define X(name, number)                                                                                                \
    case number:                                                                                                       \
        return #name;
#define T(type, names) names
        PLAIN_WORDS
        TYPED_WORDS
#undef X
#undef T
    default:
        return NULL;
    }
}

static void record(const char *function, int count, ...)
{
    va_list arguments;

    if (!device_verbose)
    {
        return;
    }
    printf("%s", function);
    va_start(arguments, count);
    for (; count > 0; count--)
    {
        const uint32_t value = va_arg(arguments, uint32_t);
        const char *name = (value >= 30000u) ? name_of(value) : NULL;
        (name != NULL) ? printf(" %s", name) : printf(" %u", (unsigned)value);
    }
    va_end(arguments);
    printf("\n");
}

/* ePWM1 or ePWM2. */
static unsigned at(uint32_t base) { return (base == EPWM2_BASE) ? 1u : 0u; }

/* Whether a pin that is low trips ePWM1 or ePWM2. */
static bool trips(unsigned index)
{
    return (model.trip_pin_low[0] && ((model.trip_signals[index] & 1u) != 0u) && (model.xbar[0] == 12u)) ||
           (model.trip_pin_low[1] && ((model.trip_signals[index] & 2u) != 0u) && (model.xbar[1] == 13u));
}

#define U(value) ((uint32_t)(value))
#define RECORD0() record(__func__, 0)
#define RECORD1(a) record(__func__, 1, U(a))
#define RECORD2(a, b) record(__func__, 2, U(a), U(b))
#define RECORD3(a, b, c) record(__func__, 3, U(a), U(b), U(c))

void EPWM_setClockPrescaler(uint32_t base, EPWM_ClockDivider a, EPWM_HSClockDivider b) { RECORD3(base, a, b); }
void EPWM_setPeriodLoadMode(uint32_t base, EPWM_PeriodLoadMode mode) { RECORD2(base, mode); }
void EPWM_setTimeBasePeriod(uint32_t base, uint16_t count) { RECORD2(base, count); *((at(base) == 0u) ? &model.period : &model.trigger_period) = count; }
void EPWM_setTimeBaseCounter(uint32_t base, uint16_t count) { RECORD2(base, count); }
void EPWM_disablePhaseShiftLoad(uint32_t base) { RECORD1(base); }
void EPWM_setTimeBaseCounterMode(uint32_t base, EPWM_TimeBaseCountMode mode) { RECORD2(base, mode); model.mode = mode; }
void EPWM_setCounterCompareShadowLoadMode(uint32_t base, EPWM_CounterCompareModule a, EPWM_CounterCompareLoadMode b)
{
    RECORD3(base, a, b);
}
void EPWM_setCounterCompareValue(uint32_t base, EPWM_CounterCompareModule module, uint16_t count)
{
    RECORD3(base, module, count);
    if (module == EPWM_COUNTER_COMPARE_A)
    {
        model.cmpa[at(base)] = count;
    }
    else
    {
        model.cmpb = count;
    }
}
void EPWM_setActionQualifierAction(uint32_t base, EPWM_ActionQualifierOutputModule module,
                                   EPWM_ActionQualifierOutput output, EPWM_ActionQualifierOutputEvent event)
{
    record(__func__, 4, U(base), U(module), U(output), U(event));
    if (event == EPWM_AQ_OUTPUT_ON_TIMEBASE_ZERO)
    {
        model.at_zero[at(base)] = output;
    }
    else
    {
        model.at_cmpa[at(base)] = output;
    }
}
void EPWM_setActionQualifierContSWForceShadowMode(uint32_t base, EPWM_ActionQualifierContForce mode) { RECORD2(base, mode); }
void EPWM_setActionQualifierContSWForceAction(uint32_t base, EPWM_ActionQualifierOutputModule module,
                                              EPWM_ActionQualifierSWOutput output)
{
    RECORD3(base, module, output);
    model.force[at(base)] = output;
}
void EPWM_setADCTriggerSource(uint32_t base, EPWM_ADCStartOfConversionType a, EPWM_ADCStartOfConversionSource b)
{
    RECORD3(base, a, b);
    if (at(base) == 1u)
    {
        model.trigger_source = b;
    }
}
void EPWM_setADCTriggerEventPrescale(uint32_t base, EPWM_ADCStartOfConversionType type, uint16_t count)
{
    RECORD3(base, type, count);
    *((at(base) == 0u) ? &model.soca_prescale : &model.trigger_prescale) = count;
}
void EPWM_enableADCTrigger(uint32_t base, EPWM_ADCStartOfConversionType type) { RECORD2(base, type); *((at(base) == 0u) ? &model.soca : &model.trigger_soca) = true; }
void EPWM_setInterruptSource(uint32_t base, uint16_t source) { RECORD2(base, source); model.interrupt_source = source; }
void EPWM_setInterruptEventCount(uint32_t base, uint16_t count) { RECORD2(base, count); }
void EPWM_enableInterrupt(uint32_t base) { RECORD1(base); model.interrupt = true; }
void EPWM_clearEventTriggerInterruptFlag(uint32_t base) { RECORD1(base); model.interrupt_flag = false; }
void EPWM_setTripZoneAction(uint32_t base, EPWM_TripZoneEvent event, EPWM_TripZoneAction action)
{
    RECORD3(base, event, action);
    model.trip_action[at(base)] = action;
}
void EPWM_enableTripZoneSignals(uint32_t base, uint16_t signals) { RECORD2(base, signals); model.trip_signals[at(base)] |= (signals == EPWM_TZ_SIGNAL_OSHT1) ? 1u : 2u; }
void EPWM_forceTripZoneEvent(uint32_t base, uint16_t event) { RECORD2(base, event); model.tripped[at(base)] = true; }
void EPWM_clearTripZoneFlag(uint32_t base, uint16_t flags)
{
    RECORD2(base, flags);
    model.tripped[at(base)] = trips(at(base)); /* a level that is still there trips again */
}
uint16_t EPWM_getTripZoneFlagStatus(uint32_t base)
{
    return model.tripped[at(base)] ? (uint16_t)EPWM_TZ_FLAG_OST : (uint16_t)0;
}

void EPWM_setSyncOutPulseMode(uint32_t base, EPWM_SyncOutPulseMode mode) { RECORD2(base, mode); model.sync_out = mode; }
void EPWM_setPhaseShift(uint32_t base, uint16_t count) { RECORD2(base, count); }
void EPWM_enablePhaseShiftLoad(uint32_t base) { RECORD1(base); model.in_phase = true; }
void EPWM_disableCounterCompareShadowLoadMode(uint32_t base, EPWM_CounterCompareModule module)
{
    RECORD2(base, module);
    model.at_once = true;
}

void ADC_setSOCPriority(uint32_t base, ADC_PriorityMode mode) { RECORD2(base, mode); model.priority = true; }
void ADC_setBurstModeConfig(uint32_t base, ADC_Trigger trigger, uint16_t size)
{
    RECORD3(base, trigger, size);
    model.burst_trigger = trigger;
    model.burst_size = size;
}
void ADC_enableBurstMode(uint32_t base) { RECORD1(base); model.burst = true; }
void ADC_setVREF(uint32_t base, ADC_ReferenceMode a, ADC_ReferenceVoltage b) { RECORD3(base, a, b); }
void ADC_setPrescaler(uint32_t base, ADC_ClkPrescale prescale) { RECORD2(base, prescale); }
void ADC_setInterruptPulseMode(uint32_t base, ADC_PulseMode mode) { RECORD2(base, mode); }
void ADC_enableConverter(uint32_t base) { RECORD1(base); model.powered_us = 0u; model.converter = true; }
void ADC_setupSOC(uint32_t base, ADC_SOCNumber number, ADC_Trigger trigger, ADC_Channel channel, uint32_t window)
{
    record(__func__, 5, U(base), U(number), U(trigger), U(channel), window);
    model.channel[number] = channel;
    model.trigger[number] = trigger;
}
void ADC_setInterruptSource(uint32_t base, ADC_IntNumber number, uint16_t trigger)
{
    RECORD3(base, number, trigger);
    model.last_conversion[number == ADC_INT_NUMBER2] = trigger;
}
void ADC_disableContinuousMode(uint32_t base, ADC_IntNumber number) { RECORD2(base, number); }
void ADC_enableInterrupt(uint32_t base, ADC_IntNumber number) { RECORD2(base, number); }
void ADC_clearInterruptStatus(uint32_t base, ADC_IntNumber number) { RECORD2(base, number); model.adc_flag[number == ADC_INT_NUMBER2] = false; }
bool ADC_getInterruptStatus(uint32_t base, ADC_IntNumber number) { (void)base; return model.adc_flag[number == ADC_INT_NUMBER2]; }
bool ADC_getInterruptOverflowStatus(uint32_t base, ADC_IntNumber number) { (void)base; (void)number; return model.adc_overflow; }
void ADC_clearInterruptOverflowStatus(uint32_t base, ADC_IntNumber number) { RECORD2(base, number); model.adc_overflow = false; }
bool ADC_isBusy(uint32_t base) { (void)base; return model.adc_busy; }
uint16_t ADC_readResult(uint32_t base, ADC_SOCNumber number) { (void)base; return model.result[number]; }

void GPIO_setDirectionMode(uint32_t pin, GPIO_Direction direction) { RECORD2(pin, direction); }
void GPIO_setPadConfig(uint32_t pin, uint32_t type) { RECORD2(pin, type); }
void GPIO_setQualificationMode(uint32_t pin, GPIO_QualificationMode mode) { RECORD2(pin, mode); }
void GPIO_setPinConfig(uint32_t config) { RECORD1(config); }
uint32_t GPIO_readPin(uint32_t pin) { return (((pin == 12u) && model.trip_pin_low[0]) || ((pin == 13u) && model.trip_pin_low[1])) ? 0u : 1u; }
void XBAR_setInputPin(XBAR_InputNum input, uint16_t pin) { RECORD2(input, pin); model.xbar[input == XBAR_INPUT2] = pin; }

void Interrupt_initModule(void) { RECORD0(); }
void Interrupt_initVectorTable(void) { RECORD0(); }
void Interrupt_register(uint32_t number, void (*handler)(void)) { RECORD1(number); model.isr = handler; }
void Interrupt_enable(uint32_t number) { RECORD1(number); model.pie = true; }
void Interrupt_clearACKGroup(uint16_t group) { RECORD1(group); model.pie_blocked = false; }

void SysCtl_disablePeripheral(SysCtl_PeripheralPCLOCKCR peripheral) { RECORD1(peripheral); }
void SysCtl_enablePeripheral(SysCtl_PeripheralPCLOCKCR peripheral) { RECORD1(peripheral); }
uint32_t SysCtl_getResetCause(void) { return model.reset_by_watchdog ? (uint32_t)SYSCTL_CAUSE_WDRS : 0u; }
bool SysCtl_isMCDClockFailureDetected(void) { return model.no_crystal; }
uint32_t SysCtl_getClock(uint32_t oscillator_hz) { return oscillator_hz * 5u; }
void SysCtl_setWatchdogMode(SysCtl_WDMode mode) { RECORD1(mode); }
void SysCtl_setWatchdogPredivider(SysCtl_WDPredivider predivider) { RECORD1(predivider); }
void SysCtl_setWatchdogPrescaler(SysCtl_WDPrescaler prescaler) { RECORD1(prescaler); }
void SysCtl_enableWatchdog(void) { RECORD0(); }
void SysCtl_serviceWatchdog(void)
{
    RECORD0();
    if (device_on_service != NULL)
    {
        device_on_service();
    }
}
void device_delay(uint32_t us) { RECORD1(us); model.powered_us += us; }
void Device_init(void) { RECORD0(); }
void Device_initGPIO(void) { RECORD0(); }
void device_dint(void) { RECORD0(); }
void device_eint(void)
{
    RECORD0();
    if (device_on_eint != NULL)
    {
        device_on_eint();
    }
}

/* The n-th sample has the codes 100 n (n modulo 41), 1, 2 at the channels 0, 1, 2, and that of the supply at 4; events are
 * those of driver.c and of solenoid.h. */
static void convert(char event)
{
    const uint16_t command =
        (uint16_t)(model.half ? 1000u : model.zero ? 0u : model.centre ? 2048u : 100u * (++model.samples % 41u));
    const uint16_t inputs[5] = {
        (event == 'h') ? (uint16_t)5000u : command, model.half ? (uint16_t)900u : model.sound ? (uint16_t)2000u : (uint16_t)1u,
        model.half ? (uint16_t)100u : model.sound ? (uint16_t)(800u + (command / 2u)) : (uint16_t)2u, 4000u,
        code_at(SOLENOID_SUPPLY_V * 0.075, FULL_V)};
    unsigned number, last = 0u;

    for (number = 0u; number < 8u; number++)
    {
        if (model.trigger[number] == ADC_TRIGGER_EPWM1_SOCA)
        {
            model.result[number] = inputs[model.channel[number] - ADC_CH_ADCIN0];
            last = number;
        }
    }
    model.adc_flag[0] = (model.last_conversion[0] == last); /* else the flag came before the results */
}

/* Pin A of ePWM1 or ePWM2 in this period. */
static const char *pin(unsigned index, uint32_t *duty)
{
    *duty = 0u;
    if (model.tripped[index] && (model.trip_action[index] == EPWM_TZ_ACTION_HIGH))
    {
        *duty = model.period + 1u;
        return "high";
    }
    if (model.tripped[index])
    {
        return "low";
    }
    if ((model.force[index] == EPWM_AQ_SW_OUTPUT_LOW) || (model.at_zero[index] != EPWM_AQ_OUTPUT_HIGH) ||
        (model.at_cmpa[index] != EPWM_AQ_OUTPUT_LOW))
    {
        return "low";
    }
    /* A compare value of 0 that is loaded here misses its own event: SPRAAI1. */
    *duty = model.cmpa[index];
    return (model.cmpa[index] == 0u) ? "full" : "pwm";
}

static struct solenoid solenoid = SOLENOID_AT_FIRST;
static uint32_t phase = 777u;
static unsigned place; /* of SOC 8 to 15 */

/* The conversions that ePWM2 starts and that are over by so many counts after the period began. */
static void convert_current(struct tick *tick, uint32_t until)
{
    const uint32_t event = (model.trigger_source == EPWM_SOC_TBCTR_U_CMPA) ? model.cmpa[1] : 0u;
    const bool runs = model.trigger_soca && model.burst && model.priority && (model.burst_size == 1u) && model.at_once &&
                      (model.burst_trigger == ADC_TRIGGER_EPWM2_SOCA) && (model.trigger_prescale > 0u) && !solenoid.stopped;

    while (runs && (phase + event + WINDOW + CONVERSION <= until) && (phase + event <= model.period))
    {
        const unsigned held = phase + event + WINDOW;

        solenoid_go_to(&solenoid, held, SYSCLK_HZ);
        model.result[8u + place] =
            (model.channel[8u + place] == ADC_CH_ADCIN3) ? code_at(solenoid_volts(&solenoid), FULL_V) : (uint16_t)4000u;
        model.adc_flag[1] = model.adc_flag[1] || (model.last_conversion[1] == 8u + place);
        place = (place + 1u) % 8u;
        tick->first = (tick->converted == 0u) ? held : tick->first;
        tick->apart = (tick->converted == 1u) ? held - tick->first : tick->apart;
        tick->converted++;
        phase += (model.trigger_period + 1u) * model.trigger_prescale;
    }
}

struct tick device_period(char event)
{
    struct tick tick = {"low", 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u};
    unsigned index;

    model.zero = (event == 'z') || (model.zero && (event != 'n'));
    model.half = (event == 'm') || (model.half && (event != 'n'));
    model.centre = (event == 'c') || (model.centre && (event != 'n'));
    model.sound = (event == 'p') || model.sound;
    model.trip_pin_low[0] = (event == 'T') || (model.trip_pin_low[0] && (event != 't'));
    model.trip_pin_low[1] = (event == 'K') || (model.trip_pin_low[1] && (event != 'k'));
    solenoid_event(&solenoid, event);
    device_side = (event == 'B') ? -1 : (event == 'A') ? 1 : device_side;
    for (index = 0u; index < 2u; index++)
    {
        model.tripped[index] = model.tripped[index] || trips(index);
    }
    /* CTR = 0: the shadows are loaded, and every so many periods the converter is started. */
    tick.output = pin(0u, &tick.duty);
    (void)pin(1u, &tick.duty_b);
    solenoid_begin(&solenoid, tick.duty);
    if (model.in_phase && (model.sync_out == EPWM_SYNC_OUT_PULSE_ON_COUNTER_ZERO))
    {
        phase = 0u;
    }
    if (model.soca && model.converter && (model.powered_us >= 1000u) && (++model.periods % model.soca_prescale == 0u) &&
        (event != 'x'))
    {
        convert(event);
    }
    model.adc_busy = (event == 'b');
    convert_current(&tick, model.cmpb);
    tick.before = tick.converted;
    /* CTR = CMPB: the interrupt, if the last one was acknowledged in both places. */
    if (model.interrupt && model.pie && !model.interrupt_flag && !model.pie_blocked &&
        (model.interrupt_source == EPWM_INT_TBCTR_U_CMPB) && (model.cmpb <= model.period))
    {
        model.interrupt_flag = true;
        model.pie_blocked = true;
        tick.served = 1u;
        model.isr();
    }
    convert_current(&tick, 2u * model.period);
    solenoid_go_to(&solenoid, model.period + 1u, SYSCLK_HZ);
    phase -= (phase > model.period) ? model.period + 1u : 0u;
    tick.current_mA = (unsigned)(1000.0 * solenoid.charge * SYSCLK_HZ / (model.period + 1u) + 0.5);
    return tick;
}
