/* The generated telemetry and core on an AVR, whose int has 16 bits as the C28x's: what one pass of the main loop hands
 * to the transmitter, and the cycles that it takes. Prints on UART0, then sleeps with interrupts off. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdio.h>

#include "DSP28x_Project.h"
#include "dz_isr.h"
#include "dz_telemetry.h"

volatile struct dz_state dz_state;
volatile struct SYS_CTRL_REGS SysCtrlRegs;
volatile struct GPIO_CTRL_REGS GpioCtrlRegs;

void device_eallow(void) {}

void device_edis(void) {}

volatile struct SCI_REGS device_plain_sci; /* its FIFO is never full */

static int put(char octet, FILE *stream)
{
    (void)stream;
    while ((UCSR0A & _BV(UDRE0)) == 0)
    {
    }
    UDR0 = (uint8_t)octet;
    return 0;
}

static FILE uart = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);

static unsigned pass_cycles(void)
{
    TCNT1 = 0;
    dz_telemetry_poll();
    return TCNT1;
}

int main(void)
{
    unsigned pack, feed, idle, i;

    UCSR0B = _BV(TXEN0);
    TCCR1B = _BV(CS10); /* counts every cycle */
    dz_telemetry_init();
    dz_telemetry.ticks = UINT32_C(0xFFFF0000) + 65530u; /* the count wraps on the way to this frame */
    dz_telemetry.due = 65530u;
    dz_state.ticks = (uint16_t)(dz_telemetry.due + DZ_FRAME_TICKS);
    dz_state.released = 1u;
    dz_state.fault = 0x000Fu;
    dz_state.u_adc = 4095u;
    dz_state.p_a_adc = 1234u;
    dz_state.p_b_adc = 900u;
    dz_state.compare_a = 59999u;
    pack = pass_cycles();
    feed = pass_cycles();
    idle = pass_cycles();
    fprintf(&uart, "pack %u\nfeed %u\nidle %u\nline ", pack, feed, idle);
    for (i = 0; i < DZ_FRAME_OCTETS; i++)
    {
        fprintf(&uart, "%02X", dz_telemetry.octets[i]);
    }
    fprintf(&uart, "\n");
    cli();
    sleep_mode();
    return 0;
}
