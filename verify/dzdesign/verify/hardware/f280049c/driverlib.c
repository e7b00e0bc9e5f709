/* The TMS320F280049C behind DriverLib's functions: ePWM, converter A, input X-BAR, pins, PIE, watchdog.
 * Sources: SPRUI33 (technical reference manual) and DriverLib's own documentation. */
#include "driverlib.h"

#include "device.h"
#include "engine.h"

#define WATCHDOG_HZ 10e6 /* INTOSC1 */
#define WATCHDOG_COUNTS 256.0
#define CONVERSION 24 /* SYSCLK cycles from the hold to the result, at ADCCLK = SYSCLK / 2 */
#define POWER_UP_S 1e-3
#define CURRENT_SOC 8u /* the first of those of low priority */

struct start
{
    uint32_t trigger, channel, window;
};

static bool other_reference; /* than 3.3 V, which the codes are of */
static struct start starts[16];
static uint16_t results[16];
static uint32_t burst_trigger, burst_size, round_robin = CURRENT_SOC, flag_source[2], priority;
static bool burst, converter, flags[2], overflow[2], flag_on[2];
static double powered_s;
static uint32_t trip_pin[6] = {0u, 0u, 0u, 0u, 0u, 0u}; /* GPIO0 after a reset */
static uint32_t function_of[GPIOS];
static bool pull_up[GPIOS], outputs[GPIOS], inverted[GPIOS], asynchronous[GPIOS];
static void (*handlers[MODULES])(void);
static bool enabled[MODULES], pie_blocked, without_oscillator;
#ifdef DEVICE_FROM_FLASH
static bool copied = false; /* functions of .TI.ramfunc, to where they run */
#else
static bool copied = true;
#endif
static uint32_t reset_cause;
static double oscillator_hz;
static uint32_t prediv = 512u, prescale = 1u;
static SysCtl_WDMode watchdog_mode;

static struct pwm *of(uint32_t base) { return &pwms[base - EPWM1_BASE]; }

void EPWM_setClockPrescaler(uint32_t base, EPWM_ClockDivider a, EPWM_HSClockDivider b)
{
    of(base)->divider = (1u << a) * ((b == EPWM_HSCLOCK_DIVIDER_1) ? 1u : 2u * b);
}
void EPWM_setPeriodLoadMode(uint32_t base, EPWM_PeriodLoadMode mode) { of(base)->period_at_once = mode == EPWM_PERIOD_DIRECT_LOAD; }
void EPWM_setTimeBasePeriod(uint32_t base, uint16_t count) { of(base)->period = count; }
void EPWM_setTimeBaseCounter(uint32_t base, uint16_t count) { of(base)->begun = now - (int64_t)count * of(base)->divider; }
void EPWM_disablePhaseShiftLoad(uint32_t base) { of(base)->in_phase = false; }
void EPWM_enablePhaseShiftLoad(uint32_t base) { of(base)->in_phase = true; }
void EPWM_setPhaseShift(uint32_t base, uint16_t count) { of(base)->phase = count; }
void EPWM_setTimeBaseCounterMode(uint32_t base, EPWM_TimeBaseCountMode mode) { of(base)->counting = mode; }
void EPWM_setSyncOutPulseMode(uint32_t base, EPWM_SyncOutPulseMode mode) { of(base)->sync_out = mode; }

void EPWM_setCounterCompareShadowLoadMode(uint32_t base, EPWM_CounterCompareModule module, EPWM_CounterCompareLoadMode mode)
{
    (void)mode;
    of(base)->compare_at_once = of(base)->compare_at_once && (module != EPWM_COUNTER_COMPARE_A);
}
void EPWM_disableCounterCompareShadowLoadMode(uint32_t base, EPWM_CounterCompareModule module)
{
    of(base)->compare_at_once = of(base)->compare_at_once || (module == EPWM_COUNTER_COMPARE_A);
}
void EPWM_setCounterCompareValue(uint32_t base, EPWM_CounterCompareModule module, uint16_t count) { of(base)->compare[module] = count; }
void EPWM_setActionQualifierAction(uint32_t base, EPWM_ActionQualifierOutputModule module,
                                   EPWM_ActionQualifierOutput output, EPWM_ActionQualifierOutputEvent event)
{
    if (module == EPWM_AQ_OUTPUT_A)
    {
        of(base)->action[event] = output;
    }
}
void EPWM_setActionQualifierContSWForceShadowMode(uint32_t base, EPWM_ActionQualifierContForce mode)
{
    of(base)->force_at_once = mode == EPWM_AQ_SW_IMMEDIATE_LOAD;
}
void EPWM_setActionQualifierContSWForceAction(uint32_t base, EPWM_ActionQualifierOutputModule module,
                                              EPWM_ActionQualifierSWOutput output)
{
    of(base)->force = (module == EPWM_AQ_OUTPUT_A) ? output : of(base)->force;
}

void EPWM_setADCTriggerSource(uint32_t base, EPWM_ADCStartOfConversionType type, EPWM_ADCStartOfConversionSource source)
{
    of(base)->trigger[type].event = source;
}
void EPWM_setADCTriggerEventPrescale(uint32_t base, EPWM_ADCStartOfConversionType type, uint16_t count) { of(base)->trigger[type].every = count; }
void EPWM_enableADCTrigger(uint32_t base, EPWM_ADCStartOfConversionType type) { of(base)->trigger[type].on = true; }
void EPWM_setInterruptSource(uint32_t base, uint16_t source) { of(base)->trigger[INTERRUPT].event = source; }
void EPWM_setInterruptEventCount(uint32_t base, uint16_t count) { of(base)->trigger[INTERRUPT].every = count; }
void EPWM_enableInterrupt(uint32_t base) { of(base)->trigger[INTERRUPT].on = true; }
void EPWM_clearEventTriggerInterruptFlag(uint32_t base) { of(base)->interrupt_flag = false; }

void EPWM_setTripZoneAction(uint32_t base, EPWM_TripZoneEvent event, EPWM_TripZoneAction action)
{
    of(base)->trip_action = (event == EPWM_TZ_ACTION_EVENT_TZA) ? action : of(base)->trip_action;
    settle();
}
void EPWM_enableTripZoneSignals(uint32_t base, uint16_t signals)
{
    of(base)->one_shot |= (uint32_t)signals >> 8;
    settle();
}
void EPWM_forceTripZoneEvent(uint32_t base, uint16_t event)
{
    of(base)->tripped = of(base)->tripped || ((event & EPWM_TZ_FORCE_EVENT_OST) != 0u);
    settle();
}
void EPWM_clearTripZoneFlag(uint32_t base, uint16_t flags)
{
    of(base)->tripped = of(base)->tripped && ((flags & EPWM_TZ_FLAG_OST) == 0u);
    settle(); /* a level that is still there trips again */
}
uint16_t EPWM_getTripZoneFlagStatus(uint32_t base) { return of(base)->tripped ? (uint16_t)EPWM_TZ_FLAG_OST : (uint16_t)0; }

void ADC_setSOCPriority(uint32_t base, ADC_PriorityMode mode) { (void)base, priority = mode; }
void ADC_setBurstModeConfig(uint32_t base, ADC_Trigger trigger, uint16_t size)
{
    (void)base;
    burst_trigger = trigger;
    burst_size = size;
}
void ADC_enableBurstMode(uint32_t base) { (void)base, burst = true; }
void ADC_setVREF(uint32_t base, ADC_ReferenceMode mode, ADC_ReferenceVoltage voltage)
{
    (void)base;
    other_reference = (mode != ADC_REFERENCE_INTERNAL) || (voltage != ADC_REFERENCE_3_3V);
}
void ADC_setPrescaler(uint32_t base, ADC_ClkPrescale divider) { (void)base, (void)divider; }
void ADC_setInterruptPulseMode(uint32_t base, ADC_PulseMode mode) { (void)base, (void)mode; }
void ADC_enableConverter(uint32_t base)
{
    (void)base;
    powered_s = 0.0;
    converter = true;
}
void ADC_setupSOC(uint32_t base, ADC_SOCNumber number, ADC_Trigger trigger, ADC_Channel channel, uint32_t window)
{
    (void)base;
    starts[number] = (struct start){trigger, channel, window};
}
void ADC_setInterruptSource(uint32_t base, ADC_IntNumber number, uint16_t source) { (void)base, flag_source[number] = source; }
void ADC_disableContinuousMode(uint32_t base, ADC_IntNumber number) { (void)base, (void)number; }
void ADC_enableInterrupt(uint32_t base, ADC_IntNumber number) { (void)base, flag_on[number] = true; }
void ADC_clearInterruptStatus(uint32_t base, ADC_IntNumber number) { (void)base, flags[number] = false; }
bool ADC_getInterruptStatus(uint32_t base, ADC_IntNumber number) { (void)base; return flags[number]; }
bool ADC_getInterruptOverflowStatus(uint32_t base, ADC_IntNumber number) { (void)base; return overflow[number]; }
void ADC_clearInterruptOverflowStatus(uint32_t base, ADC_IntNumber number) { (void)base, overflow[number] = false; }
bool ADC_isBusy(uint32_t base) { (void)base; return is_busy(0u) || is_busy(1u); }
uint16_t ADC_readResult(uint32_t base, ADC_SOCNumber number) { (void)base; return results[number]; }

static int64_t queue(unsigned group, unsigned number, int64_t from, bool first, bool last)
{
    struct conversion one = {.group = group, .slot = number, .channel = starts[number].channel, .first = first, .last = last};

    one.held = from + starts[number].window;
    one.done = one.held + CONVERSION;
    convert(&one);
    return one.done;
}

/* All conversions that a trigger starts, in the order of their numbers; in burst mode the next of low priority. */
void start_conversions(unsigned module, enum trigger trigger)
{
    const uint32_t signal = 32u + 2u * (module + 1u) + (uint32_t)trigger;
    const unsigned most = burst ? priority : 16u;
    unsigned last = 16u;
    int64_t from = now;

    if (!converter || (powered_s < POWER_UP_S))
    {
        return;
    }
    for (unsigned number = 0u; number < most; number++)
    {
        last = (starts[number].trigger == signal) ? number : last;
    }
    for (unsigned number = 0u, first = 1u; (number < most) && (last < 16u); number++)
    {
        if (starts[number].trigger == signal)
        {
            from = queue(0u, number, from, first != 0u, number == last);
            first = 0u;
        }
    }
    for (unsigned each = 0u; burst && (burst_trigger == signal) && (each < burst_size); each++)
    {
        from = queue(1u, round_robin, from, each == 0u, each + 1u == burst_size);
        round_robin = (round_robin == 15u) ? priority : round_robin + 1u;
    }
}

void converted(const struct conversion *conversion)
{
    const unsigned larger = conversion->code * 33u / 25u;

    results[conversion->slot] = !other_reference ? conversion->code : (uint16_t)((larger > 4095u) ? 4095u : larger);
    for (unsigned number = 0u; number < 2u; number++)
    {
        if (flag_on[number] && (flag_source[number] == conversion->slot))
        {
            overflow[number] = overflow[number] || flags[number];
            flags[number] = true;
        }
    }
}

void GPIO_setDirectionMode(uint32_t pin, GPIO_Direction direction)
{
    outputs[pin] = direction == GPIO_DIR_MODE_OUT;
    settle();
}
void GPIO_setPadConfig(uint32_t pin, uint32_t type)
{
    pull_up[pin] = (type & GPIO_PIN_TYPE_PULLUP) != 0u;
    inverted[pin] = (type & GPIO_PIN_TYPE_INVERT) != 0u;
    settle();
}
void GPIO_setQualificationMode(uint32_t pin, GPIO_QualificationMode mode) { asynchronous[pin] = mode == GPIO_QUAL_ASYNC; }
void GPIO_setPinConfig(uint32_t config)
{
    function_of[config / 16u] = config % 16u;
    settle();
}
uint32_t GPIO_readPin(uint32_t pin) { return (level_of(pin) == HIGH) ? 1u : 0u; }
void XBAR_setInputPin(XBAR_InputNum input, uint16_t pin)
{
    if (input < 6u)
    {
        trip_pin[input] = pin;
    }
}

int module_of(unsigned gpio) { return ((function_of[gpio] == PIN_OF_PWM) && (gpio < 2u * EPWM_MODULES)) ? (int)(gpio / 2u) : -1; }

unsigned level_of(unsigned gpio)
{
    if (module_of(gpio) >= 0)
    {
        return level_of_pwm(&pwms[gpio / 2u]);
    }
    if (outputs[gpio])
    {
        return LOW;
    }
    return (outside[gpio] == OPEN) ? (pull_up[gpio] ? HIGH : LOW) : inverted[gpio] ? HIGH - outside[gpio] : outside[gpio];
}

/* TZ1 to TZ3 come from the inputs 1 to 3 of the X-BAR; without a clock only from a pin that is asynchronous. */
unsigned trip_signals(void)
{
    unsigned signals = 0u;

    for (unsigned n = 0u; n < 3u; n++)
    {
        signals |= ((level_of(trip_pin[n]) == LOW) && (asynchronous[trip_pin[n]] || !clock_lost)) ? 1u << n : 0u;
    }
    return signals;
}

void settle_registers(void) {}

void receive(unsigned gpio, uint8_t octet) { (void)gpio, (void)octet; }

void Interrupt_initModule(void) {}
void Interrupt_initVectorTable(void) {}
void Interrupt_register(uint32_t number, void (*handler)(void)) { handlers[number - INT_EPWM1] = handler; }
void Interrupt_enable(uint32_t number) { enabled[number - INT_EPWM1] = true; }
void Interrupt_clearACKGroup(uint16_t group) { pie_blocked = pie_blocked && (group != INTERRUPT_ACK_GROUP3); }

bool interrupt_passes(unsigned module) { return enabled[module] && !pie_blocked && copied && (handlers[module] != 0); }

void serve(unsigned module)
{
    pie_blocked = true;
    interrupts_on = false;
    handlers[module]();
    interrupts_on = true;
}

void power_up(bool after_watchdog, bool without_crystal, double crystal_hz)
{
    oscillator_hz = crystal_hz;
    reset_cause = after_watchdog ? (uint32_t)SYSCTL_CAUSE_WDRS : 0u;
    without_oscillator = without_crystal;
    for (unsigned module = 0u; module < MODULES; module++)
    {
        pwms[module] = (struct pwm){.counting = STOPPED, .divider = 2u};
    }
    set_clock(WATCHDOG_HZ);
}

static void set_watchdog(void) { watchdog_s = WATCHDOG_COUNTS * prediv * prescale / WATCHDOG_HZ; }

void SysCtl_disablePeripheral(SysCtl_PeripheralPCLOCKCR peripheral)
{
    counters_run = counters_run && (peripheral != SYSCTL_PERIPH_CLK_TBCLKSYNC);
    settle();
}
void SysCtl_enablePeripheral(SysCtl_PeripheralPCLOCKCR peripheral)
{
    counters_run = counters_run || (peripheral == SYSCTL_PERIPH_CLK_TBCLKSYNC);
    settle();
}
uint32_t SysCtl_getResetCause(void) { return reset_cause; }
bool SysCtl_isMCDClockFailureDetected(void) { return without_oscillator; }
uint32_t SysCtl_getClock(uint32_t hz) { (void)hz; return (uint32_t)sysclk_hz; }
void SysCtl_setWatchdogMode(SysCtl_WDMode mode) { watchdog_mode = mode; }
void SysCtl_setWatchdogPredivider(SysCtl_WDPredivider predivider)
{
    prediv = predivider;
    set_watchdog();
}
void SysCtl_setWatchdogPrescaler(SysCtl_WDPrescaler divider)
{
    prescale = divider;
    set_watchdog();
}
void SysCtl_serviceWatchdog(void) { serve_watchdog(); }
void SysCtl_enableWatchdog(void) { watchdog_on = watchdog_mode == SYSCTL_WD_MODE_RESET; }

void device_delay(uint32_t us)
{
    powered_s += us * 1e-6;
    delay(us * 1e-6);
}
/* TI's device.c: watchdog off, the PLL at 5 times the oscillator, all peripheral clocks on; _FLASH copies .TI.ramfunc. */
void Device_init(void)
{
#ifdef _FLASH
    copied = true;
#endif
    watchdog_on = false;
    set_clock(oscillator_hz * (DEVICE_SYSCLK_FREQ / DEVICE_OSCSRC_FREQ));
    counters_run = true;
}
void Device_initGPIO(void) {}
void device_dint(void) { interrupts_on = false; }
void device_eint(void)
{
    interrupts_on = true;
    happened("start", 0u, 0u);
}
