/* Runs the generated firmware on the device model and prints what happened, one line a fact.
 *
 *   driver registers              start up, then the registers in hexadecimal
 *   driver run EVENTS [W|C]       start up (after a watchdog reset, or without crystal), then one period an event
 *   driver main                   main() itself until its first watchdog service, then one look without an interrupt
 */
#include <setjmp.h>
#include <stdio.h>
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
    SHOW("HISPCP", SysCtrlRegs.HISPCP.all);
    SHOW("PLLCR", SysCtrlRegs.PLLCR.all);
    SHOW("TBCLKSYNC", SysCtrlRegs.PCLKCR0.bit.TBCLKSYNC);
    SHOW("WDCR", SysCtrlRegs.WDCR);
    SHOW("SCSR", SysCtrlRegs.SCSR);
    SHOW("GPIO0_MUX", GpioCtrlRegs.GPAMUX1.bit.GPIO0);
    SHOW("GPIO0_PULLUP_OFF", GpioCtrlRegs.GPAPUD.bit.GPIO0);
    SHOW("GPIO12_MUX", GpioCtrlRegs.GPAMUX1.bit.GPIO12);
    SHOW("PIEIER3", PieCtrlRegs.PIEIER3.all);
    SHOW("IER", IER);
    SHOW("OST", EPwm1Regs.TZFLG.bit.OST);
    SHOW("CMPA", EPwm1Regs.CMPA.half.CMPA);
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
               "without=%u released=%u fault=%u\n",
               *events, tick.output, tick.duty, tick.served, tick.resets, tick.reset_busy, tick.acknowledged,
               EPwm1Regs.CMPA.half.CMPA, EPwm1Regs.TZFLG.bit.OST, dz_state.ticks_without_sample, dz_state.released,
               dz_state.fault);
    }
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
    show_registers();
    return 0;
}
