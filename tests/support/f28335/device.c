/* See device.h. Times are counts of SYSCLKOUT; one call of device_period() is one PWM period. */
#include <stdio.h>
#include <string.h>

#include "DSP28x_Project.h"
#include "device.h"
#include "dz_drive.h"

#define FIFO_OCTETS 16u
#define NOT_WRITTEN 0xFFFFu /* in SCITXBUF: no octet since the last look */

volatile struct EPWM_REGS EPwm1Regs, EPwm2Regs;
volatile struct ADC_REGS AdcRegs;
volatile struct ADC_RESULT_MIRROR_REGS AdcMirror;
volatile struct SYS_CTRL_REGS SysCtrlRegs;
volatile struct GPIO_CTRL_REGS GpioCtrlRegs;
volatile struct GPIO_DATA_REGS GpioDataRegs;
volatile struct PIE_CTRL_REGS PieCtrlRegs;
volatile struct PIE_VECT_TABLE PieVectTable;
volatile unsigned int IER, IFR;
Uint16 RamfuncsLoadStart, RamfuncsLoadEnd, RamfuncsRunStart;

uint8_t device_line[DEVICE_LINE_OCTETS];
unsigned device_line_count, device_line_lost, device_line_blocked;

void (*device_on_eint)(void);
void (*device_on_service)(void);

/* What EALLOW protects: a write outside EALLOW ... EDIS does not happen. */
struct protected_registers
{
    struct SYS_CTRL_REGS sys_ctrl;
    struct GPIO_CTRL_REGS gpio_ctrl;
    struct PIE_VECT_TABLE vectors;
    uint16_t tzsel[2], tzctl[2], tzclr[2], tzfrc[2], tzeint[2], hrcnfg[2];
};

static volatile struct EPWM_REGS *const pwms[2] = {&EPwm1Regs, &EPwm2Regs};
static struct protected_registers kept;
static uint16_t unlocked, active_cmpa[2], active_force[2], etflg_int, pie_blocked, command_zero, command_half;
static unsigned soca_count, int_count, sequencer, samples, period_begins;
static volatile struct SCI_REGS scia;
static uint8_t fifo[FIFO_OCTETS];
static unsigned fifo_count, shifted_counts;

static struct protected_registers protected_now(void)
{
    struct protected_registers now;
    now.sys_ctrl = SysCtrlRegs;
    now.gpio_ctrl = GpioCtrlRegs;
    now.vectors = PieVectTable;
    for (unsigned i = 0u; i < 2u; i++)
    {
        now.tzsel[i] = pwms[i]->TZSEL.all;
        now.tzctl[i] = pwms[i]->TZCTL.all;
        now.tzclr[i] = pwms[i]->TZCLR.all;
        now.tzfrc[i] = pwms[i]->TZFRC.all;
        now.tzeint[i] = pwms[i]->TZEINT.all;
        now.hrcnfg[i] = pwms[i]->HRCNFG.all;
    }
    return now;
}

void device_settle(void)
{
    SysCtrlRegs = kept.sys_ctrl;
    GpioCtrlRegs = kept.gpio_ctrl;
    PieVectTable = kept.vectors;
    for (unsigned i = 0u; i < 2u; i++)
    {
        pwms[i]->TZSEL.all = kept.tzsel[i];
        pwms[i]->TZCTL.all = kept.tzctl[i];
        pwms[i]->TZCLR.all = kept.tzclr[i];
        pwms[i]->TZFRC.all = kept.tzfrc[i];
        pwms[i]->TZEINT.all = kept.tzeint[i];
        pwms[i]->HRCNFG.all = kept.hrcnfg[i];
    }
}

void device_eallow(void)
{
    device_settle();
    unlocked = 1u;
}

static void latch_trip_input(void)
{
    for (unsigned i = 0u; i < 2u; i++)
    {
        if (((GpioDataRegs.GPADAT.bit.GPIO12 == 0u) && (GpioCtrlRegs.GPAMUX1.bit.GPIO12 == 1u)
             && (pwms[i]->TZSEL.bit.OSHT1 == 1u))
            || ((GpioDataRegs.GPADAT.bit.GPIO13 == 0u) && (GpioCtrlRegs.GPAMUX1.bit.GPIO13 == 1u)
                && (pwms[i]->TZSEL.bit.OSHT2 == 1u)))
        {
            pwms[i]->TZFLG.bit.OST = 1u;
        }
    }
}

void device_edis(void)
{
    if (unlocked == 0u)
    {
        device_settle();
    }
    unlocked = 0u;
    for (unsigned i = 0u; i < 2u; i++)
    {
        if (pwms[i]->TZCLR.bit.OST != 0u)
        {
            pwms[i]->TZFLG.bit.OST = 0u;
        }
        if (pwms[i]->TZFRC.bit.OST != 0u)
        {
            pwms[i]->TZFLG.bit.OST = 1u;
        }
        pwms[i]->TZCLR.all = 0u;
        pwms[i]->TZFRC.all = 0u;
    }
    latch_trip_input();
    kept = protected_now();
}

void device_eint(void)
{
    puts("EINT");
    if (device_on_eint != NULL)
    {
        device_on_eint();
    }
}

void device_dint(void) { puts("DINT"); }

/* An octet that was written since the last look enters the FIFO, as far as SCI-A is set up for it. */
static void take_octet(void)
{
    const int runs = (scia.SCICTL1.bit.SWRESET != 0u) && (scia.SCICTL1.bit.TXENA != 0u)
                     && (scia.SCIFFTX.bit.SCIRST != 0u) && (scia.SCIFFTX.bit.SCIFFENA != 0u)
                     && (scia.SCIFFTX.bit.TXFIFOXRESET != 0u) && (SysCtrlRegs.PCLKCR0.bit.SCIAENCLK != 0u);

    if ((scia.SCITXBUF != NOT_WRITTEN) && runs && (fifo_count < FIFO_OCTETS))
    {
        fifo[fifo_count] = (uint8_t)scia.SCITXBUF;
        fifo_count++;
    }
    else if (scia.SCITXBUF != NOT_WRITTEN)
    {
        device_line_lost++;
    }
    scia.SCITXBUF = NOT_WRITTEN;
    scia.SCIFFTX.bit.TXFFST = (uint16_t)(fifo_count & 0x1Fu);
}

volatile struct SCI_REGS *device_scia(void)
{
    take_octet();
    return &scia;
}

static unsigned counts_of_octet(void)
{
    const unsigned lspclk_counts = (SysCtrlRegs.LOSPCP.all == 0u) ? 1u : 2u * SysCtrlRegs.LOSPCP.all;
    const unsigned brr = ((unsigned)scia.SCIHBAUD << 8) | scia.SCILBAUD;
    const unsigned bits = 1u + (scia.SCICCR.bit.SCICHAR + 1u) + scia.SCICCR.bit.PARITYENA + 1u + scia.SCICCR.bit.STOPBITS;

    return lspclk_counts * 8u * (brr + 1u) * bits;
}

void device_transmit(unsigned counts)
{
    take_octet();
    shifted_counts += counts;
    while ((fifo_count > 0u) && (device_line_blocked == 0u) && (shifted_counts >= counts_of_octet()))
    {
        shifted_counts -= counts_of_octet();
        if (device_line_count < DEVICE_LINE_OCTETS)
        {
            device_line[device_line_count] = fifo[0];
            device_line_count++;
        }
        fifo_count--;
        memmove(fifo, fifo + 1, fifo_count);
    }
    if ((fifo_count == 0u) || (device_line_blocked != 0u))
    {
        shifted_counts = 0u;
    }
    take_octet();
}

void device_power_up(void)
{
    scia.SCITXBUF = NOT_WRITTEN;
    EPwm1Regs.TBCTL.all = EPwm2Regs.TBCTL.all = 0x0083u; /* HSPCLKDIV = 1, counter frozen */
    GpioDataRegs.GPADAT.bit.GPIO12 = 1u;
    GpioDataRegs.GPADAT.bit.GPIO13 = 1u;
    SysCtrlRegs.SCSR = 0x0005u;
    kept = protected_now();
}

void device_leave_behind(uint16_t value)
{
    EALLOW;
    for (unsigned i = 0u; i < 2u; i++)
    {
        volatile struct EPWM_REGS *const pwm = pwms[i];

        pwm->TBCTL.all = pwm->TBPRD = pwm->CMPCTL.all = pwm->CMPB = pwm->AQCTLA.all = pwm->AQCTLB.all = value;
        pwm->AQSFRC.all = pwm->AQCSFRC.all = pwm->DBCTL.all = pwm->PCCTL.all = pwm->ETSEL.all = pwm->ETPS.all = value;
        pwm->TZSEL.all = pwm->TZCTL.all = pwm->TZEINT.all = pwm->HRCNFG.all = value;
        pwm->TBPHS.all = pwm->CMPA.all = (uint32_t)value << 16 | value;
    }
    AdcRegs.ADCTRL1.all = AdcRegs.ADCTRL2.all = AdcRegs.ADCMAXCONV.all = AdcRegs.ADCCHSELSEQ1.all = value;
    EDIS;
}

void InitSysCtrl(void)
{
    puts("InitSysCtrl");
    EALLOW;
    SysCtrlRegs.WDCR = (uint16_t)((SysCtrlRegs.WDCR & 0x0080u) | 0x0068u);
    if (SysCtrlRegs.PLLSTS.bit.MCLKSTS == 0u)
    {
        SysCtrlRegs.PLLCR.bit.DIV = 10u;
    }
    SysCtrlRegs.PLLSTS.bit.DIVSEL = 2u;
    SysCtrlRegs.HISPCP.all = 1u;
    SysCtrlRegs.LOSPCP.all = 2u;
    SysCtrlRegs.PCLKCR0.bit.SCIAENCLK = 1u;
    SysCtrlRegs.PCLKCR0.bit.ADCENCLK = 1u;
    SysCtrlRegs.PCLKCR0.bit.TBCLKSYNC = 1u;
    EDIS;
}

void InitFlash(void) { puts("InitFlash"); }

void InitPieCtrl(void) { puts("InitPieCtrl"); }

void InitPieVectTable(void) { puts("InitPieVectTable"); }

void InitAdc(void)
{
    puts("InitAdc");
    AdcRegs.ADCTRL3.all = 0x00E0u;
}

void ServiceDog(void)
{
    puts("ServiceDog");
    if (device_on_service != NULL)
    {
        device_on_service();
    }
}

void MemCopy(Uint16 *source, Uint16 *source_end, Uint16 *destination)
{
    puts((source == &RamfuncsLoadStart && source_end == &RamfuncsLoadEnd && destination == &RamfuncsRunStart)
             ? "MemCopy"
             : "MemCopy of something else");
}

int device_side = 1;
unsigned device_drive_samples, device_drive_ticks;

#ifndef REAL_CORE
uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return (uint16_t)(u_adc + 10u * p_a_adc + 100u * p_b_adc);
}

uint16_t dz_status(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return (uint16_t)((u_adc != 0u ? 1u : 0u) + (p_a_adc != 1u ? 2u : 0u) + (p_b_adc == 2u ? 4u : 0u));
}

uint16_t dz_beta(uint16_t p_a_adc, uint16_t p_b_adc) { return (uint16_t)(3u * p_a_adc + 7u * p_b_adc); }

uint16_t dz_beta_negative(uint16_t p_a_adc, uint16_t p_b_adc) { return (uint16_t)(5u * p_a_adc + 9u * p_b_adc); }

uint16_t dz_status_negative(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return (uint16_t)(dz_status(u_adc, p_a_adc, p_b_adc) ^ 8u);
}

void dz_drive_init(struct dz_drive *drive)
{
    const struct dz_drive at_rest = {0u, 0u, 0u, 0u, 0};
    *drive = at_rest;
    device_drive_samples = device_drive_ticks = 0u;
}

void dz_drive_sample(struct dz_drive *drive, uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    drive->law = dz_comp(u_adc, p_a_adc, p_b_adc);
    drive->side = (int16_t)device_side;
    device_drive_samples++;
}

void dz_drive_tick(struct dz_drive *drive)
{
    drive->compare_a = (uint16_t)((drive->side > 0) ? drive->law : 0u);
    drive->compare_b = (uint16_t)((drive->side < 0) ? drive->law : 0u);
    device_drive_ticks++;
}
#endif

/* Codes of ADCINA0, A1, A2 in the n-th sample: 100 (n modulo 41), 1, 2; A4 is the supply; others give nonsense. */
static uint16_t code_of(unsigned channel, char event)
{
    static const uint16_t of_59999[3] = {999u, 900u, 500u}, of_30000[3] = {1000u, 900u, 200u};

    if (channel == 4u)
    {
        return device_supply_code();
    }
    if ((command_half != 0u) && (channel <= 2u))
    {
        return of_30000[channel];
    }
    if (event == 'h')
    {
        return 0xFFFFu;
    }
    if ((event == 'f') && (channel <= 2u))
    {
        return of_59999[channel];
    }
    if ((command_zero != 0u) || (channel > 2u))
    {
        return (channel > 2u) ? 4000u : 0u;
    }
    return (uint16_t)((channel == 0u) ? 100u * (samples % 41u) : channel);
}

static void convert(char event)
{
    const unsigned channels[4] = {AdcRegs.ADCCHSELSEQ1.bit.CONV00, AdcRegs.ADCCHSELSEQ1.bit.CONV01,
                                  AdcRegs.ADCCHSELSEQ1.bit.CONV02, AdcRegs.ADCCHSELSEQ1.bit.CONV03};
    volatile uint16_t *result = &AdcMirror.ADCRESULT0;
    unsigned i;

    samples++;
    for (i = 0u; i <= AdcRegs.ADCMAXCONV.bit.MAX_CONV1; i++)
    {
        /* Start/stop mode: without a reset the sequencer goes on at the next state. */
        result[sequencer] = code_of((sequencer < 4u) ? channels[sequencer] : 15u, event);
        sequencer = (sequencer + 1u) % ((AdcRegs.ADCTRL1.bit.SEQ_CASC != 0u) ? 16u : 8u);
    }
    AdcRegs.ADCST.bit.INT_SEQ1 = 1u;
}

static int conversion_is_due(void)
{
    if ((EPwm1Regs.ETSEL.bit.SOCAEN == 0u) || (EPwm1Regs.ETSEL.bit.SOCASEL != ET_CTR_ZERO)
        || (AdcRegs.ADCTRL2.bit.EPWM_SOCA_SEQ1 == 0u))
    {
        return 0;
    }
    soca_count++;
    if (soca_count < EPwm1Regs.ETPS.bit.SOCAPRD)
    {
        return 0;
    }
    soca_count = 0u;
    return 1;
}

/* Half counts of ADCCLK, from the divisors as they are set. */
static unsigned adcclk_half_counts(void)
{
    const unsigned hspclk = (SysCtrlRegs.HISPCP.all == 0u) ? 1u : 2u * SysCtrlRegs.HISPCP.all;
    const unsigned divisor = (AdcRegs.ADCTRL3.bit.ADCCLKPS == 0u) ? 1u : 2u * AdcRegs.ADCTRL3.bit.ADCCLKPS;

    return hspclk * divisor * (AdcRegs.ADCTRL1.bit.CPS + 1u) / 2u;
}

/* SPRS439, sequential sampling: 2.5 ADCCLK from the trigger, then the window of ACQ_PS + 1. */
static unsigned counts_to_hold(void)
{
    return adcclk_half_counts() * (5u + 2u * (AdcRegs.ADCTRL1.bit.ACQ_PS + 1u));
}

/* SPRS439: the first result 4 ADCCLK later, each further one after ACQ_PS + 2. */
static unsigned counts_of_sequence(void)
{
    return counts_to_hold()
           + adcclk_half_counts() * (8u + 2u * (AdcRegs.ADCTRL1.bit.ACQ_PS + 2u) * AdcRegs.ADCMAXCONV.bit.MAX_CONV1);
}

unsigned device_counts_to_hold(void) { return counts_to_hold(); }

unsigned device_counts_to_result(void) { return counts_to_hold() + adcclk_half_counts() * 8u; }

/* The event prescaler: INTPRD events make one interrupt, 0 makes none. */
static int interrupt_is_due(void)
{
    if ((EPwm1Regs.ETSEL.bit.INTEN == 0u) || (EPwm1Regs.ETPS.bit.INTPRD == 0u) || (etflg_int != 0u))
    {
        return 0;
    }
    int_count++;
    if (int_count < EPwm1Regs.ETPS.bit.INTPRD)
    {
        return 0;
    }
    int_count = 0u;
    return 1;
}

static void serve_interrupt(struct tick *tick, int busy)
{
    AdcRegs.ADCST.bit.SEQ1_BSY = busy ? 1u : 0u;
    AdcRegs.ADCTRL2.bit.RST_SEQ1 = 0u;
    EPwm1Regs.ETCLR.all = 0u;
    PieCtrlRegs.PIEACK.all = 0u;
    PieVectTable.EPWM1_INT();
    device_settle();

    tick->served = 1u;
    tick->resets = AdcRegs.ADCTRL2.bit.RST_SEQ1;
    tick->reset_busy = (busy != 0) ? tick->resets : 0u;
    tick->acknowledged = PieCtrlRegs.PIEACK.all;
    if (tick->resets != 0u)
    {
        sequencer = 0u;
    }
    if (AdcRegs.ADCST.bit.INT_SEQ1_CLR != 0u)
    {
        AdcRegs.ADCST.bit.INT_SEQ1 = 0u;
        AdcRegs.ADCST.bit.INT_SEQ1_CLR = 0u;
    }
    etflg_int = (uint16_t)((EPwm1Regs.ETCLR.bit.INT != 0u) ? 0u : 1u);
    pie_blocked = (uint16_t)(((PieCtrlRegs.PIEACK.all & PIEACK_GROUP3) != 0u) ? 0u : 1u);
    AdcRegs.ADCTRL2.bit.RST_SEQ1 = 0u;
}

/* Counts high in this period at pin A of ePWM1 or ePWM2. */
static unsigned duty_of(unsigned index)
{
    volatile const struct EPWM_REGS *pwm = pwms[index];
    const unsigned period = EPwm1Regs.TBPRD + 1u;

    if (pwm->TZFLG.bit.OST != 0u)
    {
        return (pwm->TZCTL.bit.TZA == TZ_FORCE_LO) ? 0u : period;
    }
    if ((pwm->TBCTL.bit.CTRMODE != TB_COUNT_UP) || (pwm->AQCTLA.bit.ZRO != AQ_SET) || (pwm->TBPRD + 1u != period)
        || ((index == 1u) && ((pwm->TBCTL.bit.PHSEN == 0u) || (EPwm1Regs.TBCTL.bit.SYNCOSEL != TB_CTR_ZERO))))
    {
        return 0u; /* set up as the other, and in step with it, or not at all */
    }
    if (active_force[index] == 1u)
    {
        return 0u;
    }
    /* Load at CTR = 0: a new 0 misses its compare event (SPRAAI1), the old action lasts. */
    return ((active_cmpa[index] < period) && (active_cmpa[index] != 0u)) ? active_cmpa[index] : period;
}

static void drive_pin(struct tick *tick)
{
    const unsigned period = EPwm1Regs.TBPRD + 1u;

    tick->duty = duty_of(0u);
    tick->duty_b = (GpioCtrlRegs.GPAMUX1.bit.GPIO2 == 1u) ? duty_of(1u) : 0u;
    tick->begins = period_begins;
    tick->falls = ((tick->duty > 0u) && (tick->duty < period)) ? period_begins + tick->duty : 0u;
    tick->output = (tick->duty == 0u) ? "low" : (tick->duty == period) ? "high" : "pwm";
}

/* Events: '.' none; 'x' no conversion; 'l' conversion still busy at the interrupt; 'h' codes above 12 bits;
 * 'f' codes that make 59999 of the stand-in core; 'T' / 't' trip input low / high; 'z' / 'n' command zero / normal; 'B' / 'A' the
 * stand-in core drives solenoid B / A from here; 'm' codes that make 30000 of it from here; those of current.c. */
struct tick device_period(char event)
{
    struct tick tick = {"", 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u};
    const int due = conversion_is_due() && (event != 'x');
    const unsigned at = (EPwm1Regs.ETSEL.bit.INTSEL == ET_CTRU_CMPB) ? EPwm1Regs.CMPB : 0u;
    const int busy = due && ((event == 'l') || (at < counts_of_sequence()));

    GpioDataRegs.GPADAT.bit.GPIO12 = (event == 'T') ? 0u : (event == 't') ? 1u : GpioDataRegs.GPADAT.bit.GPIO12;
    GpioDataRegs.GPADAT.bit.GPIO13 = (event == 'K') ? 0u : (event == 'k') ? 1u : GpioDataRegs.GPADAT.bit.GPIO13;
    command_half = (uint16_t)((event == 'm') ? 1u : (event == 'n') ? 0u : command_half);
    command_zero = (uint16_t)((event == 'z') ? 1u : (event == 'n') ? 0u : command_zero);
    device_side = (event == 'B') ? -1 : (event == 'A') ? 1 : device_side;
    for (unsigned i = 0u; i < 2u; i++)
    {
        active_cmpa[i] = pwms[i]->CMPA.half.CMPA;
        active_force[i] = pwms[i]->AQCSFRC.bit.CSFA;
    }
    latch_trip_input();
    drive_pin(&tick);
    tick.held = due ? period_begins + counts_to_hold() : 0u;
    if (due && !busy)
    {
        convert(event);
    }
    device_current_event(event);
    AdcRegs.ADCST.bit.SEQ2_BSY = device_current_before(&tick, tick.duty, at) ? 1u : 0u;
    if (interrupt_is_due() && (PieCtrlRegs.PIEIER3.bit.INTx1 != 0u) && ((IER & M_INT3) != 0u) && (pie_blocked == 0u))
    {
        serve_interrupt(&tick, busy);
    }
    if (due && busy)
    {
        convert(event);
    }
    device_current_after(&tick);
    AdcRegs.ADCST.bit.SEQ1_BSY = 0u;
    period_begins += EPwm1Regs.TBPRD + 1u;
    return tick;
}
