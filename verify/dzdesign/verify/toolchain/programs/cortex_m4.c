/* The check on a Cortex-M4: every input; the numbers found are put. */
#include "every_input.h"
#include "machine.h"

extern const uint8_t dz_prepared[];

static uint16_t work[3 * 65536];
static uint16_t at_zero[131072];

static void program(void)
{
    struct dz_findings findings;

    dz_check_everything(dz_prepared, work, at_zero, &findings);
    dz_put_findings(&findings, put);
}
