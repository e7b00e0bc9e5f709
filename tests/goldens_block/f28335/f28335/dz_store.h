/* Written by dzdesign 1.0.0 from template dz_store.h.jinja. Yours to edit: `dzdesign codegen` keeps what */
/* you change here, and `dzdesign verify` names this file as yours and does not check it. */

/* The memory that two copies of a calibration block are kept in. dz_store.c keeps them in RAM: what was loaded is lost
 * without supply. To keep it, write these functions for your memory; dz_store.c is yours, `dzdesign codegen` leaves it
 * as you changed it.
 *
 * What they must hold to:
 * - an erased slot reads as 0xFFFF everywhere, and a write may turn bits from 1 to 0 only: each word is written once;
 * - with the supply lost at any moment, no word changes but those of the slot that is being erased or written;
 * - they are called by the main loop only, and only while the output is held low (dz_active.h);
 * - they may take their time in one of two ways: return DZ_STORE_BUSY, and be called again with the same arguments; or
 *   return late, and serve the watchdog meanwhile. Who returns late answers nobody: an erase has 20 s, then
 *   `dzdesign load` gives up; a write has 3 s;
 * - after DZ_STORE_DONE the memory can be read at once: what was written is read back and compared.
 *
 * Flash of the TMS320F28335, with TI's Flash API for it (C2000Ware, libraries/flash_api):
 * - a sector a slot, which nothing else of the program lies in, the linked block neither (dz_calibration.cmd): erase is
 *   Flash_Erase(), write is Flash_Program(); dz_store_slot() returns the start of the sector;
 * - the API runs from RAM and takes the whole flash meanwhile: whatever else runs must lie in RAM too, what calls the API
 *   included. dz_isr() does, and while the output is held it calls nothing that lies in flash and reads no block. Every
 *   other interrupt that you add must lie in RAM, or be off. With all of them off the output stays held: the trip zone
 *   needs none;
 * - Flash_CallbackPtr, called by the API meanwhile, is the place of ServiceDog(), both in RAM: an erase takes seconds, the
 *   watchdog's time is some milliseconds, and the main loop, which serves it else, waits for the API;
 * - dz_store_init() sets the API up and erases nothing: what the slots hold is the drive's block. */
#ifndef DZ_STORE_H
#define DZ_STORE_H

#include <stdint.h>

#include "dz_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

#define DZ_STORE_SLOTS 2u

#define DZ_STORE_DONE 0u
#define DZ_STORE_BUSY 1u
#define DZ_STORE_FAILED 2u

/* 1: what was written is lost without supply. `dzdesign load` tells its user. */
#define DZ_STORE_IS_VOLATILE 1u

/* As it lies in memory. The mark is the last word written: only it makes the block a valid one (dz_slots.h). */
struct dz_slot
{
    struct dz_calibration block;
    uint16_t mark;
};

/* Once, before anything else here. */
void dz_store_init(void);

/* For reading, at any time. */
const struct dz_slot *dz_store_slot(uint16_t slot);

uint16_t dz_store_erase(uint16_t slot);

/* Writes `count` words, 1 to 32, from word `at` of the slot on. */
uint16_t dz_store_write(uint16_t slot, uint16_t at, const uint16_t *words, uint16_t count);

#ifdef __cplusplus
}
#endif

#endif
