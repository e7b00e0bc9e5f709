/* Runs the generated firmware on the device model and prints what happened, one line a fact.
 *
 *   driver registers [VALUE]      start up, then the registers in hexadecimal; VALUE is in all of them before
 *   driver run EVENTS [W|C]       start up (after a watchdog reset, or without crystal), then one period an event
 *   driver telemetry PERIODS [B]  start up, so many periods with the main loop between them (B: the line stands still
 *                                 from one half on), then the octets of the line in hexadecimal, and the counts
 *   driver preempt LOOK           start up, three samples; then the main loop packs a frame, and the interrupt comes just
 *                                 before its LOOK-th look at the state (0: not at all); prints what was read
 *   driver main                   main() itself until its first watchdog service, then one look without an interrupt
 */
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "device.h"

#define main firmware_main
#include "main.c"
#undef main

static jmp_buf out_of_main;

#define SHOW(name, value) printf("%s %04X\n", name, (unsigned)(value))

static void show_registers(void)
{
    device_settle();
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

static void leave(void) { longjmp(out_of_main, 1); }

static void leave_at_service(void) { device_on_service = leave; }

static void one_period_then_leave_at_service(void)
{
    (void)device_period('.');
    leave_at_service();
}

static void start_up(void)
{
    device_on_eint = leave;
    if (setjmp(out_of_main) == 0)
    {
        (void)firmware_main();
    }
    device_on_eint = NULL;
}

static void run(const char *events)
{
    for (; *events != '\0'; events++)
    {
        const struct tick tick = device_period(*events);
        printf("tick event=%c output=%s duty=%u served=%u resets=%u reset_busy=%u pieack=%u cmpa=%u forced=%u "
               "without=%u released=%u fault=%u held=%u begins=%u falls=%u duty_b=%u cmpb=%u forced_b=%u "
               "samples=%u drive_ticks=%u free_soft=%u free_soft_b=%u",
               *events, tick.output, tick.duty, tick.served, tick.resets, tick.reset_busy, tick.acknowledged,
               EPwm1Regs.CMPA.half.CMPA, EPwm1Regs.TZFLG.bit.OST, dz_state.ticks_without_sample, dz_state.released,
               dz_state.fault, tick.held, tick.begins, tick.falls, tick.duty_b, EPwm2Regs.CMPA.half.CMPA,
               EPwm2Regs.TZFLG.bit.OST, device_drive_samples, device_drive_ticks, EPwm1Regs.TBCTL.bit.FREE_SOFT,
               EPwm2Regs.TBCTL.bit.FREE_SOFT);
#ifdef DZ_CURRENT_REST_TICKS
        printf(" converted=%u before=%u first=%u apart=%u current=%u sum=%u offset=%u current_faults=%u set_point=%u",
               tick.converted, tick.before, tick.first, tick.apart, tick.current_mA, dz_state.current_sum,
               dz_state.current_offset, dz_state.current_faults, dz_state.set_point);
#endif
        puts("");
    }
}

/* Eight turns of the main loop a period: each is far longer than it takes on the device. */
static void run_telemetry(unsigned periods, int block)
{
    unsigned period;
    unsigned turn;
    unsigned i;

    for (period = 0u; period < periods; period++)
    {
        device_line_blocked = (block && (2u * period >= periods)) ? 1u : 0u;
        (void)device_period('.');
        for (turn = 0u; turn < 8u; turn++)
        {
            service_watchdog_if_isr_ran();
            dz_telemetry_poll();
            device_transmit((EPwm1Regs.TBPRD + 1u) / 8u);
        }
    }
    printf("sent %u\ndropped %u\nlost %u\nticks %u\nline ", dz_telemetry.sent, dz_telemetry.dropped,
           device_line_lost, dz_state.ticks);
    for (i = 0u; i < device_line_count; i++)
    {
        printf("%02X", device_line[i]);
    }
    puts("");
}

static unsigned looks_left;

/* Takes the place of `dz_state` in a copy of dz_telemetry.c that the test makes. */
volatile struct dz_state *device_state(void)
{
    if (looks_left == 1u)
    {
        (void)device_period('.');
        (void)device_period('.'); /* a new sample at any rate */
    }
    looks_left -= (looks_left > 0u) ? 1u : 0u;
    return &dz_state;
}

static void run_preempted(unsigned look)
{
    unsigned i;

    for (i = 0u; i < DZ_FRAME_TICKS; i++)
    {
        (void)device_period('.');
    }
    looks_left = look;
    dz_telemetry_poll();
    looks_left = 0u;
    dz_telemetry_poll();
    device_transmit(1000000000u);
    dz_telemetry_poll();
    device_transmit(1000000000u);
    printf("line ");
    for (i = 0u; i < device_line_count; i++)
    {
        printf("%02X", device_line[i]);
    }
    puts("");
}

static void run_main(void)
{
    device_on_eint = one_period_then_leave_at_service;
    if (setjmp(out_of_main) == 0)
    {
        (void)firmware_main();
    }
    device_on_service = NULL;
    puts("without an interrupt:");
    service_watchdog_if_isr_ran();
    puts("with one:");
    (void)device_period('.');
    service_watchdog_if_isr_ran();
}

int main(int count, char **words)
{
    device_power_up();
    if ((count > 2) && (strcmp(words[1], "registers") == 0))
    {
        device_leave_behind((uint16_t)strtoul(words[2], NULL, 16));
    }
    if ((count > 3) && (words[3][0] == 'W'))
    {
        EALLOW;
        SysCtrlRegs.WDCR = 0x0080u;
        EDIS;
    }
    if ((count > 3) && (words[3][0] == 'C'))
    {
        EALLOW;
        SysCtrlRegs.PLLSTS.bit.MCLKSTS = 1u;
        EDIS;
    }
    if ((count > 1) && (strcmp(words[1], "main") == 0))
    {
        run_main();
        return 0;
    }
    start_up();
    if ((count > 2) && (strcmp(words[1], "run") == 0))
    {
        run(words[2]);
        return 0;
    }
    if ((count > 2) && (strcmp(words[1], "telemetry") == 0))
    {
        run_telemetry((unsigned)strtoul(words[2], NULL, 10), count > 3);
        return 0;
    }
    if ((count > 2) && (strcmp(words[1], "preempt") == 0))
    {
        run_preempted((unsigned)strtoul(words[2], NULL, 10));
        return 0;
    }
    show_registers();
    return 0;
}
