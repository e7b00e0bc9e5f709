/* Written by dzdesign 1.0.0 from template dz_board.h.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours. */

/* The board: values alone, each a plain number without a suffix, which `dzdesign verify` reads and runs the firmware
 * with. Each may be given to the compiler instead. An impossible value stops the build, in dz_hardware.h.
 * Crystal and channels are declared to `dzdesign design` too, in [board] of dzdesign.toml: `verify` compares. */
#ifndef DZ_BOARD_H
#define DZ_BOARD_H

/* Crystal or oscillator in Hz; SYSCLKOUT = OSC_HZ * PLL_DIV / 2 must be 150 MHz. */
#ifndef DZ_BOARD_OSC_HZ
#define DZ_BOARD_OSC_HZ 30000000
#endif
#ifndef DZ_BOARD_PLL_DIV
#define DZ_BOARD_PLL_DIV 10
#endif

/* PWM module and pin of solenoid A: EPWMnA is GPIO 2 (n - 1). */
#ifndef DZ_BOARD_PWM
#define DZ_BOARD_PWM 1
#endif
#ifndef DZ_BOARD_PWM_GPIO
#define DZ_BOARD_PWM_GPIO 0
#endif

/* Of solenoid B, the next module: the first one keeps it in step. */
#ifndef DZ_BOARD_PWM_B
#define DZ_BOARD_PWM_B 2
#endif
#ifndef DZ_BOARD_PWM_B_GPIO
#define DZ_BOARD_PWM_B_GPIO 2
#endif

/* Channels of the converter: 0 to 7 are ADCINA0 to A7, 8 to 15 are ADCINB0 to B7. */
#ifndef DZ_BOARD_COMMAND
#define DZ_BOARD_COMMAND 0
#endif
#ifndef DZ_BOARD_PRESSURE_A
#define DZ_BOARD_PRESSURE_A 1
#endif
#ifndef DZ_BOARD_PRESSURE_B
#define DZ_BOARD_PRESSURE_B 2
#endif

/* Sample window: ACQ_PS + 1 cycles of ADCCLK, 12.5 MHz. */
#ifndef DZ_BOARD_ACQ_PS
#define DZ_BOARD_ACQ_PS 15
#endif

/* Trip input, low = output off: TZ1 to TZ6 are GPIO12 to GPIO17. */
#ifndef DZ_BOARD_TZ
#define DZ_BOARD_TZ 1
#endif
#ifndef DZ_BOARD_TRIP_GPIO
#define DZ_BOARD_TRIP_GPIO 12
#endif

/* Serial line and its pins, out and in: SCI-A (1) on GPIO29 and 28 or 35 and 36; SCI-B (2) on 9 and 11, 14 and 15, 18
 * and 19 or 22 and 23; SCI-C (3) on 63 and 62. */
#ifndef DZ_BOARD_SCI
#define DZ_BOARD_SCI 1
#endif
#ifndef DZ_BOARD_SCI_TX_GPIO
#define DZ_BOARD_SCI_TX_GPIO 29
#endif
#ifndef DZ_BOARD_SCI_RX_GPIO
#define DZ_BOARD_SCI_RX_GPIO 28
#endif

/* Watchdog: 0 or 1 resets after 4.37 ms without service, 2 to 7 after 2, 4, 8, 16, 32 or 64 times as long. */
#ifndef DZ_BOARD_WDPS
#define DZ_BOARD_WDPS 0
#endif

#endif
