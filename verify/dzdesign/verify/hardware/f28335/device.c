/* The TMS320F28335 behind its registers: EALLOW, clocks, sequencers of the converter, pins, trip zones, PIE, watchdog.
 * Sources: SPRUI07 (technical reference manual), SPRS439 (data sheet). The serial lines are in serial.c. */
#include "DSP28x_Project.h"
#include "device.h"

#define WDFLAG 0x80u
#define WDDIS 0x40u
#define WDENINT 0x02u
#define WDCHK 5u
#define WATCHDOG_PERIODS (512.0 * 256.0) /* of the crystal */
#define PLL_LOCK_PERIODS 131072.0
#define ASYNCHRONOUS 3u /* GPAQSEL */
#define OTHER_GROUPS 0x0FFBu

volatile struct EPWM_REGS EPwmRegs[EPWM_MODULES];
volatile struct ADC_REGS AdcRegs;
volatile struct ADC_RESULTS AdcMirror;
volatile struct SYS_CTRL_REGS SysCtrlRegs;
volatile struct GPIO_CTRL_REGS GpioCtrlRegs;
volatile struct GPIO_DATA_REGS GpioDataRegs;
volatile struct PIE_CTRL_REGS PieCtrlRegs;
volatile struct PIE_VECT_TABLE PieVectTable;
volatile unsigned int IER, IFR;
#define ADCCLK_MOST_HZ 25e6 /* SPRS439 */
Uint16 RamfuncsLoadStart, RamfuncsLoadEnd, RamfuncsRunStart;

/* What EALLOW protects: a write outside EALLOW ... EDIS does not happen. */
struct protected_registers
{
    struct SYS_CTRL_REGS sys_ctrl;
    struct GPIO_CTRL_REGS gpio_ctrl;
    struct PIE_VECT_TABLE vectors;
    struct
    {
        uint16_t tzsel, tzctl, tzclr, tzfrc, tzeint, hrcnfg;
    } of_pwm[EPWM_MODULES];
};

static struct protected_registers kept;
static bool unlocked, peripherals_clocked, pie_blocked, converter_too_fast;
#ifdef DEVICE_FROM_FLASH
static bool copied = false;
#else
static bool copied = true;
#endif
static double crystal_hz;
static uint16_t wdcr_before;
static unsigned sequencers[2]; /* where each goes on */

static struct protected_registers protected_now(void)
{
    struct protected_registers now_there;

    now_there.sys_ctrl = SysCtrlRegs;
    now_there.gpio_ctrl = GpioCtrlRegs;
    now_there.vectors = PieVectTable;
    for (unsigned i = 0u; i < EPWM_MODULES; i++)
    {
        now_there.of_pwm[i].tzsel = EPwmRegs[i].TZSEL.all;
        now_there.of_pwm[i].tzctl = EPwmRegs[i].TZCTL.all;
        now_there.of_pwm[i].tzclr = EPwmRegs[i].TZCLR.all;
        now_there.of_pwm[i].tzfrc = EPwmRegs[i].TZFRC.all;
        now_there.of_pwm[i].tzeint = EPwmRegs[i].TZEINT.all;
        now_there.of_pwm[i].hrcnfg = EPwmRegs[i].HRCNFG.all;
    }
    return now_there;
}

static void undo_writes(void)
{
    SysCtrlRegs = kept.sys_ctrl;
    GpioCtrlRegs = kept.gpio_ctrl;
    PieVectTable = kept.vectors;
    for (unsigned i = 0u; i < EPWM_MODULES; i++)
    {
        EPwmRegs[i].TZSEL.all = kept.of_pwm[i].tzsel;
        EPwmRegs[i].TZCTL.all = kept.of_pwm[i].tzctl;
        EPwmRegs[i].TZCLR.all = kept.of_pwm[i].tzclr;
        EPwmRegs[i].TZFRC.all = kept.of_pwm[i].tzfrc;
        EPwmRegs[i].TZEINT.all = kept.of_pwm[i].tzeint;
        EPwmRegs[i].HRCNFG.all = kept.of_pwm[i].hrcnfg;
    }
}

static void reset_pwms(void)
{
    for (unsigned i = 0u; i < EPWM_MODULES; i++)
    {
        static const struct EPWM_REGS at_reset;
        EPwmRegs[i] = at_reset;
        EPwmRegs[i].TBCTL.all = 0x0083u; /* HSPCLKDIV = 1, counter frozen */
    }
}

/* Without DIVSEL the clock is divided by 4, with a PLL factor of 0 the PLL is bypassed. */
static void clock_from_registers(void)
{
    static const double divider[4] = {4.0, 4.0, 2.0, 1.0};
    const unsigned factor = (SysCtrlRegs.PLLCR.bit.DIV == 0u) ? 1u : SysCtrlRegs.PLLCR.bit.DIV;

    set_clock(crystal_hz * factor / divider[SysCtrlRegs.PLLSTS.bit.DIVSEL]);
}

static void watchdog_from_registers(void)
{
    const unsigned wdps = SysCtrlRegs.WDCR & 7u;

    if (SysCtrlRegs.WDCR != wdcr_before)
    {
        if (((SysCtrlRegs.WDCR >> 3) & 7u) != WDCHK)
        {
            reset_by_watchdog();
        }
        wdcr_before = SysCtrlRegs.WDCR;
    }
    watchdog_on = ((SysCtrlRegs.WDCR & WDDIS) == 0u) && ((SysCtrlRegs.SCSR & WDENINT) == 0u);
    watchdog_s = WATCHDOG_PERIODS * (1u << ((wdps > 1u) ? wdps - 1u : 0u)) / crystal_hz;
}

void device_eallow(void)
{
    undo_writes();
    unlocked = true;
}

/* Which of the writes since EALLOW came first is not known: pull-ups are seen before pins change their function. */
static void settle_pull_ups(void)
{
    const struct GPIO_CTRL_REGS written = GpioCtrlRegs;

    GpioCtrlRegs = kept.gpio_ctrl;
    GpioCtrlRegs.GPAPUD = written.GPAPUD;
    GpioCtrlRegs.GPBPUD = written.GPBPUD;
    settle();
    GpioCtrlRegs = written;
}

void device_edis(void)
{
    if (!unlocked)
    {
        undo_writes();
    }
    settle_pull_ups();
    unlocked = false;
    kept = protected_now();
    clock_from_registers();
    watchdog_from_registers();
    settle();
}

void device_eint(void)
{
    interrupts_on = true;
    happened("start", 0u, 0u);
}

void device_dint(void) { interrupts_on = false; }

static unsigned of_pin(uint32_t low_half, uint32_t high_half, unsigned gpio)
{
    return (((gpio % 32u < 16u) ? low_half : high_half) >> (2u * (gpio % 16u))) & 3u;
}

unsigned mux_of(unsigned gpio)
{
    return (gpio < 32u) ? of_pin(GpioCtrlRegs.GPAMUX1.all, GpioCtrlRegs.GPAMUX2.all, gpio)
                        : of_pin(GpioCtrlRegs.GPBMUX1.all, GpioCtrlRegs.GPBMUX2.all, gpio);
}

/* GPIO0, 2, ... 10 are outputs A of the modules; output B of none is used. */
int module_of(unsigned gpio) { return ((gpio < 2u * EPWM_MODULES) && (gpio % 2u == 0u) && (mux_of(gpio) == 1u)) ? (int)(gpio / 2u) : -1; }

unsigned level_of(unsigned gpio)
{
    const uint32_t bit = UINT32_C(1) << (gpio % 32u);
    const uint32_t pull_up_off = (gpio < 32u) ? GpioCtrlRegs.GPAPUD.all : GpioCtrlRegs.GPBPUD.all;
    const uint32_t output = (gpio < 32u) ? GpioCtrlRegs.GPADIR.all : GpioCtrlRegs.GPBDIR.all;

    if ((gpio < 2u * EPWM_MODULES) && (mux_of(gpio) == 1u))
    {
        return (module_of(gpio) >= 0) ? level_of_pwm(&pwms[gpio / 2u]) : LOW;
    }
    if ((mux_of(gpio) == 0u) && ((output & bit) != 0u))
    {
        return (((gpio < 32u) ? GpioDataRegs.GPADAT.all : GpioDataRegs.GPBDAT.all) & bit) != 0u ? HIGH : LOW;
    }
    return (outside[gpio] != OPEN) ? outside[gpio] : ((pull_up_off & bit) == 0u) ? HIGH : LOW;
}

/* Without a clock only an input that is asynchronous passes. */
static bool trips(unsigned gpio)
{
    const unsigned qualifier = of_pin(GpioCtrlRegs.GPAQSEL1.all, GpioCtrlRegs.GPAQSEL2.all, gpio);

    return (level_of(gpio) == LOW) && ((qualifier == ASYNCHRONOUS) || !clock_lost);
}

/* TZ1 to TZ6 are GPIO12 to GPIO17; TZ5 and TZ6 are GPIO28 and GPIO29 too. */
unsigned trip_signals(void)
{
    unsigned signals = 0u;

    for (unsigned n = 0u; n < 6u; n++)
    {
        const unsigned gpio = 12u + n;
        const bool taken = mux_of(gpio) == ((gpio < 16u) ? 1u : 3u);
        const bool other = (n >= 4u) && (mux_of(24u + n) == 3u) && trips(24u + n);

        signals |= ((taken && trips(gpio)) || other) ? 1u << n : 0u;
    }
    return signals;
}

static void settle_pwm(unsigned module)
{
    static const unsigned high_speed[8] = {1u, 2u, 4u, 6u, 8u, 10u, 12u, 14u};
    volatile struct EPWM_REGS *const regs = &EPwmRegs[module];
    struct pwm *const pwm = &pwms[module];

    pwm->counting = regs->TBCTL.bit.CTRMODE;
    pwm->divider = high_speed[regs->TBCTL.bit.HSPCLKDIV] << regs->TBCTL.bit.CLKDIV;
    pwm->period = regs->TBPRD;
    pwm->period_at_once = regs->TBCTL.bit.PRDLD == 1u;
    pwm->in_phase = regs->TBCTL.bit.PHSEN == 1u;
    pwm->phase = regs->TBPHS.half.TBPHS;
    pwm->sync_out = regs->TBCTL.bit.SYNCOSEL;
    pwm->compare[0] = regs->CMPA.half.CMPA;
    pwm->compare[1] = regs->CMPB;
    pwm->compare_at_once = regs->CMPCTL.bit.SHDWAMODE == CC_IMMEDIATE;
    pwm->action[AT_ZERO] = regs->AQCTLA.bit.ZRO;
    pwm->action[AT_PERIOD] = regs->AQCTLA.bit.PRD;
    pwm->action[AT_A_UP] = regs->AQCTLA.bit.CAU;
    pwm->action[AT_A_DOWN] = regs->AQCTLA.bit.CAD;
    pwm->action[AT_B_UP] = regs->AQCTLA.bit.CBU;
    pwm->action[AT_B_DOWN] = regs->AQCTLA.bit.CBD;
    pwm->force = regs->AQCSFRC.bit.CSFA;
    pwm->force_at_once = regs->AQSFRC.bit.RLDCSF == 3u;
    pwm->trip_action = regs->TZCTL.bit.TZA;
    pwm->at_halt = regs->TBCTL.bit.FREE_SOFT;
    pwm->one_shot = (regs->TZSEL.all >> 8) & 0x3Fu;
    pwm->trigger[SOC_A].on = regs->ETSEL.bit.SOCAEN == 1u;
    pwm->trigger[SOC_A].event = regs->ETSEL.bit.SOCASEL;
    pwm->trigger[SOC_A].every = regs->ETPS.bit.SOCAPRD;
    pwm->trigger[SOC_B].on = regs->ETSEL.bit.SOCBEN == 1u;
    pwm->trigger[SOC_B].event = regs->ETSEL.bit.SOCBSEL;
    pwm->trigger[SOC_B].every = regs->ETPS.bit.SOCBPRD;
    pwm->trigger[INTERRUPT].on = regs->ETSEL.bit.INTEN == 1u;
    pwm->trigger[INTERRUPT].event = regs->ETSEL.bit.INTSEL;
    pwm->trigger[INTERRUPT].every = regs->ETPS.bit.INTPRD;
    pwm->tripped = (pwm->tripped && (regs->TZCLR.bit.OST == 0u)) || (regs->TZFRC.bit.OST != 0u);
    pwm->interrupt_flag = pwm->interrupt_flag && (regs->ETCLR.bit.INT == 0u);
    regs->ETCLR.all = 0u;
    regs->TZCLR.all = regs->TZFRC.all = 0u;
    kept.of_pwm[module].tzclr = kept.of_pwm[module].tzfrc = 0u;
    regs->TZFLG.bit.OST = pwm->tripped ? 1u : 0u;
}

static void settle_converter(void)
{
    AdcRegs.ADCST.bit.SEQ1_BSY = is_busy(0u) ? 1u : 0u;
    AdcRegs.ADCST.bit.SEQ2_BSY = is_busy(1u) ? 1u : 0u;
    if (AdcRegs.ADCST.bit.INT_SEQ1_CLR != 0u)
    {
        AdcRegs.ADCST.bit.INT_SEQ1 = AdcRegs.ADCST.bit.INT_SEQ1_CLR = 0u;
    }
    if (AdcRegs.ADCST.bit.INT_SEQ2_CLR != 0u)
    {
        AdcRegs.ADCST.bit.INT_SEQ2 = AdcRegs.ADCST.bit.INT_SEQ2_CLR = 0u;
    }
    if (AdcRegs.ADCTRL2.bit.RST_SEQ1 != 0u)
    {
        happened("sequencer", 1u, is_busy(0u));
        sequencers[0] = 0u;
    }
    if (AdcRegs.ADCTRL2.bit.RST_SEQ2 != 0u)
    {
        sequencers[1] = 0u;
    }
    AdcRegs.ADCTRL2.bit.RST_SEQ1 = AdcRegs.ADCTRL2.bit.RST_SEQ2 = 0u;
}

void settle_registers(void)
{
    const uint32_t a = GpioDataRegs.GPADAT.all, b = GpioDataRegs.GPBDAT.all;
    uint32_t inputs[2] = {0u, 0u};

    if (!unlocked)
    {
        undo_writes();
    }
    if (!peripherals_clocked)
    {
        reset_pwms();
    }
    for (unsigned module = 0u; module < EPWM_MODULES; module++)
    {
        settle_pwm(module);
    }
    settle_converter();
    counters_run = SysCtrlRegs.PCLKCR0.bit.TBCLKSYNC == 1u;
    GpioDataRegs.GPADAT.all = ((a | GpioDataRegs.GPASET.all) & ~GpioDataRegs.GPACLEAR.all) ^ GpioDataRegs.GPATOGGLE.all;
    GpioDataRegs.GPBDAT.all = ((b | GpioDataRegs.GPBSET.all) & ~GpioDataRegs.GPBCLEAR.all) ^ GpioDataRegs.GPBTOGGLE.all;
    GpioDataRegs.GPASET.all = GpioDataRegs.GPACLEAR.all = GpioDataRegs.GPATOGGLE.all = 0u;
    GpioDataRegs.GPBSET.all = GpioDataRegs.GPBCLEAR.all = GpioDataRegs.GPBTOGGLE.all = 0u;
    for (unsigned gpio = 0u; gpio < GPIOS; gpio++)
    {
        inputs[gpio / 32u] |= (level_of(gpio) == HIGH) ? UINT32_C(1) << (gpio % 32u) : 0u;
    }
    GpioDataRegs.GPADAT.all = inputs[0];
    GpioDataRegs.GPBDAT.all = inputs[1];
}

static unsigned channel_of(unsigned place)
{
    const unsigned four[4] = {AdcRegs.ADCCHSELSEQ1.all, AdcRegs.ADCCHSELSEQ2.all, AdcRegs.ADCCHSELSEQ3.all,
                              AdcRegs.ADCCHSELSEQ4.all};

    return (four[place / 4u] >> (4u * (place % 4u))) & 15u;
}

/* Start/stop mode: a sequencer that is not reset goes on where it stopped. SPRS439, sequential sampling: 2.5 ADCCLK from
 * the trigger to the window of ACQ_PS + 1, the first result 4 ADCCLK after it, each further one after ACQ_PS + 2. */
void start_conversions(unsigned module, enum trigger trigger)
{
    const unsigned hspclk = (SysCtrlRegs.HISPCP.all == 0u) ? 1u : 2u * SysCtrlRegs.HISPCP.all;
    const unsigned prescale = (AdcRegs.ADCTRL3.bit.ADCCLKPS == 0u) ? 1u : 2u * AdcRegs.ADCTRL3.bit.ADCCLKPS;
    const double adcclk = (double)(hspclk * prescale * (AdcRegs.ADCTRL1.bit.CPS + 1u));
    const double window = AdcRegs.ADCTRL1.bit.ACQ_PS + 1u;
    const unsigned cascaded = AdcRegs.ADCTRL1.bit.SEQ_CASC, group = (unsigned)trigger;
    const unsigned listens = (trigger == SOC_A) ? AdcRegs.ADCTRL2.bit.EPWM_SOCA_SEQ1 : AdcRegs.ADCTRL2.bit.EPWM_SOCB_SEQ2;
    const unsigned last = (trigger == SOC_A) ? AdcRegs.ADCMAXCONV.bit.MAX_CONV1 : AdcRegs.ADCMAXCONV.bit.MAX_CONV2;

    (void)module; /* all modules' starts are one signal */
    converter_too_fast = sysclk_hz / adcclk > ADCCLK_MOST_HZ;
    if ((listens == 0u) || ((trigger == SOC_B) && (cascaded != 0u)) || !peripherals_clocked || is_busy(group) ||
        !converter_hears(channel_of((trigger == SOC_A) ? sequencers[0] : 8u + sequencers[1])))
    {
        return;
    }
    for (unsigned each = 0u; each <= last; each++)
    {
        const unsigned slot = (trigger == SOC_A) ? sequencers[0] : 8u + sequencers[1];
        struct conversion one = {.group = group, .slot = slot, .channel = channel_of(slot), .first = each == 0u, .last = each == last};

        one.held = now + (int64_t)(adcclk * (2.5 + window + each * (window + 1.0)));
        one.done = one.held + (int64_t)(adcclk * 4.0);
        convert(&one);
        sequencers[group] = (sequencers[group] + 1u) % ((cascaded != 0u) ? 16u : 8u);
    }
}

void converted(const struct conversion *conversion)
{
    /* A converter that is clocked faster than it bears gives nothing to rely on. */
    const uint16_t code = converter_too_fast ? 0xFFFu : conversion->code;

    (&AdcMirror.ADCRESULT0)[conversion->slot] = code;
    (&AdcRegs.ADCRESULT0)[conversion->slot] = (uint16_t)(code << 4);
    if (conversion->last && (conversion->group == 0u))
    {
        AdcRegs.ADCST.bit.INT_SEQ1 = 1u;
    }
    else if (conversion->last)
    {
        AdcRegs.ADCST.bit.INT_SEQ2 = 1u;
    }
}

/* PIE group 3: until it is acknowledged no other interrupt of it comes. Other groups wait for theirs meanwhile. An interrupt that was not copied to where it runs
 * from, in the FLASH build, does nothing either. */
bool interrupt_passes(unsigned module)
{
    return (((PieCtrlRegs.PIEIER3.all >> module) & 1u) != 0u) && ((IER & M_INT3) != 0u) && !pie_blocked && copied &&
           ((&PieVectTable.EPWM1_INT)[module] != 0);
}

void serve(unsigned module)
{
    PieCtrlRegs.PIEACK.all = OTHER_GROUPS;
    interrupts_on = false;
    (&PieVectTable.EPWM1_INT)[module]();
    interrupts_on = true;
    pie_blocked = (PieCtrlRegs.PIEACK.all & PIEACK_GROUP3) == 0u;
    if (!pie_blocked && (PieCtrlRegs.PIEACK.all != PIEACK_GROUP3))
    {
        happened("acknowledged", PieCtrlRegs.PIEACK.all, 0u);
    }
}

void power_up(bool after_watchdog, bool without_crystal, double hz)
{
    crystal_hz = hz;
    for (unsigned module = 0u; module < MODULES; module++)
    {
        pwms[module] = (struct pwm){.counting = STOPPED, .divider = 2u};
    }
    reset_pwms();
    GpioCtrlRegs.GPAPUD.all = 0x0FFFu; /* the pins of the PWM have no pull-up after a reset */
    SysCtrlRegs.PLLSTS.bit.PLLLOCKS = 1u;
    SysCtrlRegs.PLLSTS.bit.MCLKSTS = without_crystal ? 1u : 0u;
    SysCtrlRegs.WDCR = wdcr_before = after_watchdog ? WDFLAG : 0u;
    kept = protected_now();
    clock_from_registers();
    watchdog_from_registers();
    watchdog_on = true;
}

void DisableDog(void)
{
    EALLOW;
    SysCtrlRegs.WDCR = (uint16_t)((SysCtrlRegs.WDCR & WDFLAG) | 0x0068u);
    EDIS;
}

void InitPll(Uint16 factor, Uint16 divider)
{
    EALLOW;
    SysCtrlRegs.PLLSTS.bit.DIVSEL = 0u;
    if (SysCtrlRegs.PLLSTS.bit.MCLKSTS == 0u)
    {
        SysCtrlRegs.PLLCR.bit.DIV = (uint16_t)(factor & 15u);
    }
    EDIS;
    delay(PLL_LOCK_PERIODS / crystal_hz);
    EALLOW;
    SysCtrlRegs.PLLSTS.bit.DIVSEL = (uint16_t)(divider & 3u);
    EDIS;
}

void InitPeripheralClocks(void)
{
    peripherals_clocked = true;
    EALLOW;
    SysCtrlRegs.HISPCP.all = 1u;
    SysCtrlRegs.LOSPCP.all = 2u;
    SysCtrlRegs.PCLKCR0.bit.SCIAENCLK = SysCtrlRegs.PCLKCR0.bit.SCIBENCLK = SysCtrlRegs.PCLKCR0.bit.SCICENCLK = 1u;
    SysCtrlRegs.PCLKCR0.bit.ADCENCLK = 1u;
    SysCtrlRegs.PCLKCR0.bit.TBCLKSYNC = 1u;
    EDIS;
}

void InitFlash(void) {}

void InitPieCtrl(void) {}

void InitPieVectTable(void) {}

void InitAdc(void)
{
    AdcRegs.ADCTRL3.all = 0x00E0u;
    delay(5e-3);
}

void ServiceDog(void) { serve_watchdog(); }

void MemCopy(Uint16 *source, Uint16 *source_end, Uint16 *destination)
{
    copied = (source == &RamfuncsLoadStart) && (source_end == &RamfuncsLoadEnd) && (destination == &RamfuncsRunStart);
}
