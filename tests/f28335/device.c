/* See device.h. Times are counts of SYSCLKOUT; one call of device_period() is one PWM period. */
#include <stdio.h>
#include <string.h>

#include "DSP28x_Project.h"
#include "device.h"
#include "dz_comp.h"

#define SEQUENCE_COUNTS 678u /* 56.5 ADCCLK of 12.5 MHz at 150 MHz */

volatile struct EPWM_REGS EPwm1Regs;
volatile struct ADC_REGS AdcRegs;
volatile struct ADC_RESULT_MIRROR_REGS AdcMirror;
volatile struct SYS_CTRL_REGS SysCtrlRegs;
volatile struct GPIO_CTRL_REGS GpioCtrlRegs;
volatile struct GPIO_DATA_REGS GpioDataRegs;
volatile struct PIE_CTRL_REGS PieCtrlRegs;
volatile struct PIE_VECT_TABLE PieVectTable;
volatile unsigned int IER, IFR;
Uint16 RamfuncsLoadStart, RamfuncsLoadEnd, RamfuncsRunStart;

void (*device_on_eint)(void);
void (*device_on_service)(void);

/* What EALLOW protects: a write outside EALLOW ... EDIS does not happen. */
struct protected_registers
{
    struct SYS_CTRL_REGS sys_ctrl;
    struct GPIO_CTRL_REGS gpio_ctrl;
    struct PIE_VECT_TABLE vectors;
    uint16_t tzsel, tzctl, tzclr, tzfrc;
};

static struct protected_registers kept;
static uint16_t unlocked, active_cmpa, active_force, etflg_int, pie_blocked, command_zero;
static unsigned soca_count, sequencer, samples;

static struct protected_registers protected_now(void)
{
    struct protected_registers now;
    now.sys_ctrl = SysCtrlRegs;
    now.gpio_ctrl = GpioCtrlRegs;
    now.vectors = PieVectTable;
    now.tzsel = EPwm1Regs.TZSEL.all;
    now.tzctl = EPwm1Regs.TZCTL.all;
    now.tzclr = EPwm1Regs.TZCLR.all;
    now.tzfrc = EPwm1Regs.TZFRC.all;
    return now;
}

void device_settle(void)
{
    SysCtrlRegs = kept.sys_ctrl;
    GpioCtrlRegs = kept.gpio_ctrl;
    PieVectTable = kept.vectors;
    EPwm1Regs.TZSEL.all = kept.tzsel;
    EPwm1Regs.TZCTL.all = kept.tzctl;
    EPwm1Regs.TZCLR.all = kept.tzclr;
    EPwm1Regs.TZFRC.all = kept.tzfrc;
}

void device_eallow(void)
{
    device_settle();
    unlocked = 1u;
}

static void latch_trip_input(void)
{
    if ((GpioDataRegs.GPADAT.bit.GPIO12 == 0u) && (GpioCtrlRegs.GPAMUX1.bit.GPIO12 == 1u)
        && (EPwm1Regs.TZSEL.bit.OSHT1 == 1u))
    {
        EPwm1Regs.TZFLG.bit.OST = 1u;
    }
}

void device_edis(void)
{
    if (unlocked == 0u)
    {
        device_settle();
    }
    unlocked = 0u;
    if (EPwm1Regs.TZCLR.bit.OST != 0u)
    {
        EPwm1Regs.TZFLG.bit.OST = 0u;
    }
    if (EPwm1Regs.TZFRC.bit.OST != 0u)
    {
        EPwm1Regs.TZFLG.bit.OST = 1u;
    }
    EPwm1Regs.TZCLR.all = 0u;
    EPwm1Regs.TZFRC.all = 0u;
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

void device_power_up(void)
{
    EPwm1Regs.TBCTL.all = 0x0083u; /* HSPCLKDIV = 1, counter frozen */
    GpioDataRegs.GPADAT.bit.GPIO12 = 1u;
    SysCtrlRegs.SCSR = 0x0005u;
    kept = protected_now();
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

uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)
{
    return (uint16_t)(u_adc + 10u * p_a_adc + 100u * p_b_adc);
}

/* Codes of ADCINA0, A1, A2 in the n-th sample: 100 n, 1, 2; other channels give nonsense. */
static uint16_t code_of(unsigned channel, char event)
{
    if (event == 'h')
    {
        return 0xFFFFu;
    }
    if ((command_zero != 0u) || (channel > 2u))
    {
        return (channel > 2u) ? 4000u : 0u;
    }
    return (uint16_t)((channel == 0u) ? 100u * samples : channel);
}

static void convert(char event)
{
    const unsigned channels[3] = {AdcRegs.ADCCHSELSEQ1.bit.CONV00, AdcRegs.ADCCHSELSEQ1.bit.CONV01,
                                  AdcRegs.ADCCHSELSEQ1.bit.CONV02};
    volatile uint16_t *result = &AdcMirror.ADCRESULT0;
    unsigned i;

    samples++;
    for (i = 0u; i <= AdcRegs.ADCMAXCONV.bit.MAX_CONV1; i++)
    {
        /* Start/stop mode: without a reset the sequencer goes on at the next state. */
        result[sequencer] = code_of((sequencer < 3u) ? channels[sequencer] : 15u, event);
        sequencer = (sequencer + 1u) % 16u;
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

static void drive_pin(struct tick *tick)
{
    const unsigned period = EPwm1Regs.TBPRD + 1u;
    if (EPwm1Regs.TZFLG.bit.OST != 0u)
    {
        tick->duty = (EPwm1Regs.TZCTL.bit.TZA == TZ_FORCE_LO) ? 0u : period;
    }
    else
    {
        tick->duty = (active_force == 1u) ? 0u : (active_cmpa < period) ? active_cmpa : period;
        /* Load at CTR = 0: a new 0 misses its compare event (SPRAAI1), the old action lasts. */
        if ((active_force != 1u) && (active_cmpa == 0u))
        {
            tick->duty = period;
        }
    }
    tick->output = (tick->duty == 0u) ? "low" : (tick->duty == period) ? "high" : "pwm";
}

/* Events: '.' none; 'x' no conversion; 'l' conversion still busy at the interrupt; 'h' codes above 12 bits;
 * 'T' / 't' trip input low / high; 'z' / 'n' command zero / normal. */
struct tick device_period(char event)
{
    struct tick tick = {"", 0u, 0u, 0u, 0u, 0u};
    const int due = conversion_is_due() && (event != 'x');
    const unsigned at = (EPwm1Regs.ETSEL.bit.INTSEL == ET_CTRU_CMPB) ? EPwm1Regs.CMPB : 0u;
    const int busy = due && ((event == 'l') || (at < SEQUENCE_COUNTS));

    GpioDataRegs.GPADAT.bit.GPIO12 = (event == 'T') ? 0u : (event == 't') ? 1u : GpioDataRegs.GPADAT.bit.GPIO12;
    command_zero = (uint16_t)((event == 'z') ? 1u : (event == 'n') ? 0u : command_zero);
    active_cmpa = EPwm1Regs.CMPA.half.CMPA;
    active_force = EPwm1Regs.AQCSFRC.bit.CSFA;
    latch_trip_input();
    drive_pin(&tick);
    if (due && !busy)
    {
        convert(event);
    }
    if ((EPwm1Regs.ETSEL.bit.INTEN != 0u) && (PieCtrlRegs.PIEIER3.bit.INTx1 != 0u) && ((IER & M_INT3) != 0u)
        && (etflg_int == 0u) && (pie_blocked == 0u))
    {
        serve_interrupt(&tick, busy);
    }
    if (due && busy)
    {
        convert(event);
    }
    AdcRegs.ADCST.bit.SEQ1_BSY = 0u;
    return tick;
}
