/* Of the F28335: what its parts share. See device.c and serial.c. */
#ifndef DEVICE_H
#define DEVICE_H

#include "engine.h"

unsigned mux_of(unsigned gpio);

#endif
