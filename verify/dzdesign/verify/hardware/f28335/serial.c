/* SCI-A, B and C of the F28335, each with its FIFOs and the pins that it can have. */
#include "DSP28x_Project.h"
#include "device.h"
#include "serial.h"

#include <string.h>

#define LINES 3u
#define FIFO_OCTETS 16u
#define NOT_WRITTEN 0xFFFFu /* in SCITXBUF: no octet since the last look */

struct line
{
    volatile struct SCI_REGS registers;
    uint8_t out[FIFO_OCTETS], in[FIFO_OCTETS];
    unsigned out_count, in_count;
    int64_t free_from; /* when the transmitter has sent what it sends */
    int64_t pace;      /* counts of the last octet */
    bool seen;
};

struct pin
{
    unsigned line, gpio, mux;
};

static const struct pin transmits[] = {{0, 29, 1}, {0, 35, 1}, {1, 9, 2}, {1, 14, 2}, {1, 18, 2}, {1, 22, 3}, {2, 63, 1}};
static const struct pin receives[] = {{0, 28, 1}, {0, 36, 1}, {1, 11, 2}, {1, 15, 2}, {1, 19, 2}, {1, 23, 3}, {2, 62, 1}};
static struct line lines[LINES];
static unsigned looked_at;
bool serial_blocked;
unsigned serial_lost, serial_missed;

/* The GPIO that a line has for a direction, or GPIOS. */
static unsigned gpio_of(const struct pin *pins, unsigned line)
{
    for (unsigned each = 0u; each < 7u; each++)
    {
        if ((pins[each].line == line) && (mux_of(pins[each].gpio) == pins[each].mux))
        {
            return pins[each].gpio;
        }
    }
    return GPIOS;
}

static bool is_clocked(unsigned number)
{
    const unsigned clocked[LINES] = {SysCtrlRegs.PCLKCR0.bit.SCIAENCLK, SysCtrlRegs.PCLKCR0.bit.SCIBENCLK,
                                     SysCtrlRegs.PCLKCR0.bit.SCICENCLK};
    return clocked[number] != 0u;
}

static int64_t counts_of_octet(volatile const struct SCI_REGS *sci)
{
    const unsigned lspclk_counts = (SysCtrlRegs.LOSPCP.all == 0u) ? 1u : 2u * SysCtrlRegs.LOSPCP.all;
    const unsigned brr = ((unsigned)sci->SCIHBAUD << 8) | sci->SCILBAUD;
    const unsigned bits = 1u + (sci->SCICCR.bit.SCICHAR + 1u) + sci->SCICCR.bit.PARITYENA + 1u + sci->SCICCR.bit.STOPBITS;

    return (int64_t)lspclk_counts * 8 * (brr + 1u) * bits;
}

/* Octets leave, one that was written enters the FIFO if the line is set up for it. A software reset clears the
 * receiver's errors; a FIFO that is held in reset is empty. */
static void settle_line(unsigned number)
{
    struct line *const line = &lines[number];
    volatile struct SCI_REGS *const sci = &line->registers;
    const bool runs = (sci->SCICTL1.bit.SWRESET != 0u) && (sci->SCICTL1.bit.TXENA != 0u) && (sci->SCIFFTX.bit.SCIRST != 0u) &&
                      (sci->SCIFFTX.bit.SCIFFENA != 0u) && (sci->SCIFFTX.bit.TXFIFOXRESET != 0u) && is_clocked(number);

    while ((line->out_count > 0u) && !serial_blocked && (line->free_from + counts_of_octet(sci) <= now))
    {
        if (line->pace != counts_of_octet(sci))
        {
            line->pace = counts_of_octet(sci);
            happened("pace", gpio_of(transmits, number), (unsigned)line->pace);
        }
        line->free_from += line->pace;
        happened("octet", gpio_of(transmits, number), line->out[0]);
        line->out_count--;
        memmove(line->out, line->out + 1, line->out_count);
    }
    if ((line->out_count == 0u) || serial_blocked)
    {
        line->free_from = now;
    }
    if (line->seen && (sci->SCITXBUF != NOT_WRITTEN))
    {
        if (runs && (line->out_count < FIFO_OCTETS))
        {
            line->out[line->out_count] = (uint8_t)sci->SCITXBUF;
            line->out_count++;
        }
        else
        {
            serial_lost++;
        }
    }
    line->seen = true;
    sci->SCITXBUF = NOT_WRITTEN;
    sci->SCIFFTX.bit.TXFFST = (uint16_t)(line->out_count & 0x1Fu);
    sci->SCICTL2.bit.TXEMPTY = (line->out_count == 0u) ? 1u : 0u;
    if (sci->SCICTL1.bit.SWRESET == 0u)
    {
        sci->SCIRXST.all = 0u;
    }
    if (sci->SCIFFRX.bit.RXFIFORESET == 0u)
    {
        line->in_count = 0u;
    }
    sci->SCIFFRX.bit.RXFFST = (uint16_t)(line->in_count & 0x1Fu);
}

void serial_receive(unsigned number, uint8_t octet)
{
    struct line *const line = &lines[number];
    volatile struct SCI_REGS *const sci = &line->registers;
    const bool runs = (sci->SCICTL1.bit.SWRESET != 0u) && (sci->SCICTL1.bit.RXENA != 0u) && (sci->SCIFFTX.bit.SCIRST != 0u) &&
                      (sci->SCIFFTX.bit.SCIFFENA != 0u) && (sci->SCIFFRX.bit.RXFIFORESET != 0u) &&
                      (gpio_of(receives, number) < GPIOS);

    settle_line(number);
    if (runs && (sci->SCIRXST.bit.RXERROR == 0u) && (line->in_count < FIFO_OCTETS))
    {
        line->in[line->in_count] = octet;
        line->in_count++;
    }
    else
    {
        serial_missed++;
    }
}

void receive(unsigned gpio, uint8_t octet)
{
    for (unsigned number = 0u; number < LINES; number++)
    {
        if (gpio_of(receives, number) == gpio)
        {
            serial_receive(number, octet);
        }
    }
}

void serial_break(unsigned number) { lines[number].registers.SCIRXST.bit.BRKDT = lines[number].registers.SCIRXST.bit.RXERROR = 1u; }

unsigned device_octet_in(void)
{
    struct line *const line = &lines[looked_at];

    line->registers.OCTETS_IN[0].all = (uint16_t)((line->in_count > 0u) ? line->in[0] : 0xFFu);
    if (line->in_count > 0u)
    {
        line->in_count--;
        memmove(line->in, line->in + 1, line->in_count);
    }
    return 0u;
}

volatile struct SCI_REGS *device_sci(unsigned number)
{
    looked_at = number;
    settle_line(number);
    return &lines[number].registers;
}
