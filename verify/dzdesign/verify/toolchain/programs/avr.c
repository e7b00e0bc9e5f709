/* The check on an AVR, of a sample: the numbers found are put. */
#include "every_input.h"
#include "machine.h"

extern const uint8_t DZ_TABLE dz_prepared[];

static void program(void)
{
    struct dz_findings findings;

    dz_check_sample(dz_prepared, &findings);
    dz_put_findings(&findings, put);
}
