/* Host stand-in for TI's device.h. */
#ifndef DEVICE_H
#define DEVICE_H

#include <stdint.h>

#define DEVICE_OSCSRC_FREQ 20000000U
#define DEVICE_SYSCLK_FREQ ((DEVICE_OSCSRC_FREQ * 10 * 1) / 2)
#define DEVICE_DELAY_US(x) device_delay(x)

void device_delay(uint32_t us);
void Device_init(void);
void Device_initGPIO(void);

#endif
