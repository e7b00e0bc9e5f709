/* The conversions of a solenoid's current, as the registers of ePWM2 and of the ADC say. See device.h and solenoid.h. */
#include "../solenoid.h"

#include "DSP28x_Project.h"
#include "device.h"

#define SYSCLK_HZ 150e6
#define FULL_V 3.0
#define PLACES 8u

static struct solenoid solenoid = SOLENOID_AT_FIRST;
static unsigned place, phase = 1234u, period_end;

uint16_t device_supply_code(void) { return code_at(SOLENOID_SUPPLY_V * 0.075, FULL_V); }

void device_current_event(char event) { solenoid_event(&solenoid, event); }

static int starts(void)
{
    return (EPwm2Regs.ETSEL.bit.SOCBEN == 1u) && (EPwm2Regs.TBCTL.bit.CTRMODE == TB_COUNT_UP)
           && (EPwm2Regs.ETPS.bit.SOCBPRD != 0u) && (AdcRegs.ADCTRL2.bit.EPWM_SOCB_SEQ2 == 1u)
           && (AdcRegs.ADCTRL1.bit.SEQ_CASC == 0u) && (SysCtrlRegs.PCLKCR0.bit.TBCLKSYNC == 1u) && (solenoid.stopped == 0u);
}

/* Counts of the next start of conversion since the period began. */
static unsigned next_start(void)
{
    const unsigned event = (EPwm2Regs.ETSEL.bit.SOCBSEL == ET_CTRU_CMPA) ? EPwm2Regs.CMPA.half.CMPA : 0u;

    return phase + event;
}

static unsigned channel_of(unsigned at)
{
    const unsigned four = (at < 4u) ? AdcRegs.ADCCHSELSEQ3.all : AdcRegs.ADCCHSELSEQ4.all;

    return (four >> (4u * (at % 4u))) & 15u;
}

static void convert_until(struct tick *tick, unsigned until)
{
    volatile uint16_t *const results = &AdcMirror.ADCRESULT8;

    while (starts() && (next_start() + device_counts_to_result() <= until) && (next_start() < period_end))
    {
        const unsigned held = next_start() + device_counts_to_hold();

        solenoid_go_to(&solenoid, held, SYSCLK_HZ);
        for (unsigned i = 0u; i <= AdcRegs.ADCMAXCONV.bit.MAX_CONV2; i++)
        {
            results[place] = (channel_of(place) == 3u) ? code_at(solenoid_volts(&solenoid), FULL_V) : (uint16_t)4000u;
            place = (place + 1u) % PLACES;
        }
        AdcRegs.ADCST.bit.INT_SEQ2 = 1u;
        tick->first = (tick->converted == 0u) ? held : tick->first;
        tick->apart = (tick->converted == 1u) ? held - tick->first : tick->apart;
        tick->converted++;
        phase += (EPwm2Regs.TBPRD + 1u) * EPwm2Regs.ETPS.bit.SOCBPRD;
    }
}

int device_current_before(struct tick *tick, unsigned duty, unsigned at)
{
    period_end = EPwm1Regs.TBPRD + 1u;
    solenoid_begin(&solenoid, duty);
    if ((EPwm2Regs.TBCTL.bit.PHSEN == 1u) && (EPwm1Regs.TBCTL.bit.SYNCOSEL == TB_CTR_ZERO))
    {
        phase = EPwm2Regs.TBPHS.half.TBPHS;
    }
    convert_until(tick, at);
    tick->before = tick->converted;
    return starts() && (next_start() <= at);
}

void device_current_after(struct tick *tick)
{
    if (AdcRegs.ADCST.bit.INT_SEQ2_CLR != 0u)
    {
        AdcRegs.ADCST.bit.INT_SEQ2 = 0u;
        AdcRegs.ADCST.bit.INT_SEQ2_CLR = 0u;
    }
    if (AdcRegs.ADCTRL2.bit.RST_SEQ2 != 0u)
    {
        place = 0u;
        AdcRegs.ADCTRL2.bit.RST_SEQ2 = 0u;
    }
    AdcRegs.ADCST.bit.SEQ2_BSY = 0u;
    convert_until(tick, 2u * period_end);
    solenoid_go_to(&solenoid, period_end, SYSCLK_HZ);
    phase -= (phase >= period_end) ? period_end : 0u;
    tick->current_mA = (unsigned)(1000.0 * solenoid.charge * SYSCLK_HZ / period_end + 0.5);
}
