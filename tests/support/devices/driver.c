/* Runs the generated firmware on the model of its device and prints what happened, one line a fact.
 *
 *   driver run EVENTS [W|C]       main() until interrupts are on (after a watchdog reset, or without crystal), then one
 *                                 period an event
 *   driver main                   the same and two periods, with the main loop's look at the watchdog after the first
 * Of the F28335 alone:
 *   driver registers [VALUE]      start up, then the registers in hexadecimal; VALUE is in all of them before
 *   driver telemetry PERIODS [B]  so many periods with the main loop between them (B: the line stands still from one half
 *                                 on), then the octets of the line in hexadecimal, and the counts
 *   driver preempt LOOK           start up, three samples; then the main loop packs a frame, and the interrupt comes just
 *                                 before its LOOK-th look at the state (0: not at all); prints what was read
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "periods.h"

#define main firmware_main
#include "main.c"
#undef main

#ifdef STAND_IN_CORE
#include "dz_drive.h"
#else
static const unsigned device_drive_samples = 0u, device_drive_ticks = 0u;
#endif

static void run(const char *events)
{
    for (; *events != '\0'; events++)
    {
        const struct tick tick = device_period(*events, 1u, NULL);
        const unsigned period = pwms[0].active_period + 1u;
        const unsigned falls = ((tick.duty > 0u) && (tick.duty < period)) ? tick.falls : 0u;

        printf("tick event=%c output=%s duty=%u served=%u resets=%u reset_busy=%u pieack=%u cmpa=%u forced=%u "
               "without=%u released=%u fault=%u held=%u begins=%u falls=%u duty_b=%u cmpb=%u forced_b=%u "
               "samples=%u drive_ticks=%u",
               *events, (tick.duty == 0u) ? "low" : (tick.duty == period) ? "high" : "pwm", tick.duty, tick.served,
               tick.resets, tick.reset_busy, tick.acknowledged, (unsigned)pwms[0].compare[0], pwms[0].tripped ? 1u : 0u,
               dz_state.ticks_without_sample, dz_state.released, dz_state.fault, tick.held, tick.begins, falls,
               tick.duty_b, (unsigned)pwms[1].compare[0], pwms[1].tripped ? 1u : 0u, device_drive_samples,
               device_drive_ticks);
#ifdef DZ_FAULT_CALIBRATION
        printf(" calibration=%u", dz_state.calibration);
#endif
#ifdef DZ_CURRENT_REST_TICKS
        printf(" converted=%u before=%u first=%u apart=%u current=%u sum=%u offset=%u current_faults=%u set_point=%u",
               tick.converted, tick.before, tick.first, tick.apart, tick.current_mA, dz_state.current_sum,
               dz_state.current_offset, dz_state.current_faults, dz_state.set_point);
#endif
        puts("");
    }
}

static void run_main(void)
{
    (void)device_period('.', 1u, NULL);
    service_watchdog_if_isr_ran();
    puts("without an interrupt:");
    service_watchdog_if_isr_ran();
    puts("with one:");
    (void)device_period('.', 1u, NULL);
    service_watchdog_if_isr_ran();
    printf("services %u\n", device_services);
}

#ifdef F28335
#include "serial.h"

#define SHOW(name, value) printf("%s %04X\n", name, (unsigned)(value))

static void show_registers(void)
{
    settle_registers();
    SHOW("TBCTL", EPwm1Regs.TBCTL.all);
    SHOW("TBPRD", EPwm1Regs.TBPRD);
    SHOW("CMPCTL", EPwm1Regs.CMPCTL.all);
    SHOW("CMPB", EPwm1Regs.CMPB);
    SHOW("AQCTLA", EPwm1Regs.AQCTLA.all);
    SHOW("ETSEL", EPwm1Regs.ETSEL.all);
    SHOW("ETPS", EPwm1Regs.ETPS.all);
    SHOW("TZSEL", EPwm1Regs.TZSEL.all);
    SHOW("TZCTL", EPwm1Regs.TZCTL.all);
    SHOW("ADCTRL1", AdcRegs.ADCTRL1.all);
    SHOW("ADCTRL2", AdcRegs.ADCTRL2.all);
    SHOW("ADCTRL3", AdcRegs.ADCTRL3.all);
    SHOW("ADCMAXCONV", AdcRegs.ADCMAXCONV.all);
    SHOW("ADCCHSELSEQ1", AdcRegs.ADCCHSELSEQ1.all);
    SHOW("ADCCHSELSEQ3", AdcRegs.ADCCHSELSEQ3.all);
    SHOW("ADCCHSELSEQ4", AdcRegs.ADCCHSELSEQ4.all);
    SHOW("GPIO13_MUX", GpioCtrlRegs.GPAMUX1.bit.GPIO13);
    SHOW("TRIGGER_CMPA", EPwm2Regs.CMPA.half.CMPA);
    SHOW("TRIGGER_ETPS", EPwm2Regs.ETPS.all);
    SHOW("ADCCHSELSEQ2", AdcRegs.ADCCHSELSEQ2.all);
    SHOW("HISPCP", SysCtrlRegs.HISPCP.all);
    SHOW("PLLCR", SysCtrlRegs.PLLCR.all);
    SHOW("TBCLKSYNC", SysCtrlRegs.PCLKCR0.bit.TBCLKSYNC);
    SHOW("WDCR", SysCtrlRegs.WDCR);
    SHOW("SCSR", SysCtrlRegs.SCSR);
    SHOW("GPIO0_MUX", GpioCtrlRegs.GPAMUX1.bit.GPIO0);
    SHOW("GPIO0_PULLUP_OFF", GpioCtrlRegs.GPAPUD.bit.GPIO0);
    SHOW("GPIO12_MUX", GpioCtrlRegs.GPAMUX1.bit.GPIO12);
    SHOW("LOSPCP", SysCtrlRegs.LOSPCP.all);
    SHOW("SCICCR", SciaRegs.SCICCR.all);
    SHOW("SCICTL1", SciaRegs.SCICTL1.all);
    SHOW("SCICTL2", SciaRegs.SCICTL2.all & 0x3Fu); /* without what the transmitter says of itself */
    SHOW("SCIHBAUD", SciaRegs.SCIHBAUD);
    SHOW("SCILBAUD", SciaRegs.SCILBAUD);
    SHOW("SCIFFTX", SciaRegs.SCIFFTX.all);
    SHOW("SCIFFRX", SciaRegs.SCIFFRX.all);
    SHOW("SCIFFCT", SciaRegs.SCIFFCT.all);
    SHOW("GPIO28_MUX", GpioCtrlRegs.GPAMUX2.bit.GPIO28);
    SHOW("GPIO28_QUALIFIER", GpioCtrlRegs.GPAQSEL2.bit.GPIO28);
    SHOW("GPIO29_MUX", GpioCtrlRegs.GPAMUX2.bit.GPIO29);
    SHOW("PIEIER3", PieCtrlRegs.PIEIER3.all);
    SHOW("IER", IER);
    SHOW("OST", EPwm1Regs.TZFLG.bit.OST);
    SHOW("CMPA", EPwm1Regs.CMPA.half.CMPA);
    SHOW("CMPAHR", EPwm1Regs.CMPA.half.CMPAHR);
    SHOW("TBPHS", EPwm1Regs.TBPHS.half.TBPHS);
    SHOW("AQCTLB", EPwm1Regs.AQCTLB.all);
    SHOW("AQSFRC", EPwm1Regs.AQSFRC.all);
    SHOW("AQCSFRC", EPwm1Regs.AQCSFRC.all);
    SHOW("DBCTL", EPwm1Regs.DBCTL.all);
    SHOW("PCCTL", EPwm1Regs.PCCTL.all);
    SHOW("TZEINT", EPwm1Regs.TZEINT.all);
    SHOW("HRCNFG", EPwm1Regs.HRCNFG.all);
    SHOW("SECOND_DBCTL", EPwm2Regs.DBCTL.all);
    SHOW("SECOND_PCCTL", EPwm2Regs.PCCTL.all);
    SHOW("SECOND_AQCTLB", EPwm2Regs.AQCTLB.all);
    SHOW("SECOND_TZEINT", EPwm2Regs.TZEINT.all);
    SHOW("SECOND_HRCNFG", EPwm2Regs.HRCNFG.all);
    SHOW("SECOND_CMPB", EPwm2Regs.CMPB);
    SHOW("SECOND_ETPS", EPwm2Regs.ETPS.all);
    SHOW("SECOND_TBCTL", EPwm2Regs.TBCTL.all);
    SHOW("SECOND_TBPRD", EPwm2Regs.TBPRD);
    SHOW("SECOND_CMPCTL", EPwm2Regs.CMPCTL.all);
    SHOW("SECOND_AQCTLA", EPwm2Regs.AQCTLA.all);
    SHOW("SECOND_ETSEL", EPwm2Regs.ETSEL.all);
    SHOW("SECOND_TZSEL", EPwm2Regs.TZSEL.all);
    SHOW("SECOND_TZCTL", EPwm2Regs.TZCTL.all);
    SHOW("SECOND_OST", EPwm2Regs.TZFLG.bit.OST);
    SHOW("GPIO2_MUX", GpioCtrlRegs.GPAMUX1.bit.GPIO2);
    SHOW("GPIO2_PULLUP_OFF", GpioCtrlRegs.GPAPUD.bit.GPIO2);
    SHOW("VECTOR_SET", PieVectTable.EPWM1_INT == dz_isr);
}

/* All registers of ePWM and ADC as another program may have left them, before this one starts. */
static void leave_behind(uint16_t value)
{
    EALLOW;
    InitPeripheralClocks();
    EALLOW;
    for (unsigned i = 0u; i < 2u; i++)
    {
        volatile struct EPWM_REGS *const pwm = &EPwmRegs[i];

        pwm->TBCTL.all = pwm->TBPRD = pwm->CMPCTL.all = pwm->CMPB = pwm->AQCTLA.all = pwm->AQCTLB.all = value;
        pwm->AQSFRC.all = pwm->AQCSFRC.all = pwm->DBCTL.all = pwm->PCCTL.all = pwm->ETSEL.all = pwm->ETPS.all = value;
        pwm->TZSEL.all = pwm->TZCTL.all = pwm->TZEINT.all = pwm->HRCNFG.all = value;
        pwm->TBPHS.all = pwm->CMPA.all = (uint32_t)value << 16 | value;
    }
    AdcRegs.ADCTRL1.all = AdcRegs.ADCMAXCONV.all = AdcRegs.ADCCHSELSEQ1.all = value;
    EDIS;
}

static void turn(void)
{
    service_watchdog_if_isr_ran();
    dz_telemetry_poll();
}

static void show_line(void)
{
    (void)SciaRegs.SCICTL1.all; /* an access has what was sent meanwhile leave */
    printf("line ");
    for (unsigned i = 0u; i < device_line_count; i++)
    {
        printf("%02X", device_line[i]);
    }
    puts("");
}

/* Eight turns of the main loop a period: each is far longer than it takes on the device. */
static void run_telemetry(unsigned periods, int block)
{
    for (unsigned period = 0u; period < periods; period++)
    {
        serial_blocked = block && (2u * period >= periods);
        (void)device_period('.', 8u, turn);
    }
    printf("sent %u\ndropped %u\nlost %u\nticks %u\nservices %u\n", dz_telemetry.sent, dz_telemetry.dropped,
           serial_lost, dz_state.ticks, device_services);
    show_line();
}

static unsigned looks_left;

/* Takes the place of `dz_state` in a copy of dz_telemetry.c that the test makes. */
volatile struct dz_state *device_state(void);

volatile struct dz_state *device_state(void)
{
    if (looks_left == 1u)
    {
        (void)device_period('.', 1u, NULL);
        (void)device_period('.', 1u, NULL); /* a new sample at any rate */
    }
    looks_left -= (looks_left > 0u) ? 1u : 0u;
    return &dz_state;
}

static void run_preempted(unsigned look)
{
    for (unsigned i = 0u; i < DZ_FRAME_TICKS; i++)
    {
        (void)device_period('.', 1u, NULL);
    }
    looks_left = look;
    dz_telemetry_poll();
    looks_left = 0u;
    interrupts_on = false;
    for (unsigned i = 0u; i < 3u; i++)
    {
        dz_telemetry_poll();
        (void)SciaRegs.SCICTL1.all;
        delay(0.01); /* longer than a frame takes */
    }
    show_line();
}

static void run_f28335(int count, char **words)
{
    if (strcmp(words[1], "telemetry") == 0)
    {
        run_telemetry((unsigned)strtoul(words[2], NULL, 10), count > 3);
    }
    else if (strcmp(words[1], "preempt") == 0)
    {
        run_preempted((unsigned)strtoul(words[2], NULL, 10));
    }
    else
    {
        show_registers();
    }
}
#endif

int main(int count, char **words)
{
    const char start = (count > 3) ? words[3][0] : ' ';

    device_power_up(start == 'W', start == 'C');
#if defined(F28335) || defined(DZ_CURRENT_REST_TICKS)
    pwms[1].starts_at = 1234u; /* the first module puts it in step */
#endif
#ifdef F28335
    if ((count > 2) && (strcmp(words[1], "registers") == 0))
    {
        leave_behind((uint16_t)strtoul(words[2], NULL, 16));
    }
#endif
    device_start();
    if (strcmp(words[1], "run") == 0)
    {
        run(words[2]);
    }
    else if (strcmp(words[1], "main") == 0)
    {
        run_main();
    }
#ifdef F28335
    else
    {
        run_f28335(count, words);
    }
#endif
    return 0;
}
