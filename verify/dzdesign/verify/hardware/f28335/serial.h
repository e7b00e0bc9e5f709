/* What comes on a serial line of the F28335; octets that are sent are events "octet" with the GPIO. See serial.c. */
#ifndef SERIAL_H
#define SERIAL_H

#include <stdbool.h>
#include <stdint.h>

extern bool serial_blocked;                   /* the transmitters stand still */
extern unsigned serial_lost, serial_missed;   /* octets that a line that was full, or not set up, did not take */
void serial_receive(unsigned line, uint8_t octet);
void serial_break(unsigned line);             /* the line is pulled low for long */

#endif
