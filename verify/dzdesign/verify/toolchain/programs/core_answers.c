/* Compare value and status word that one side of the core gives at each of some codes of command and sensors A and B;
 * DZ_COMP and DZ_STATUS are its functions. */
#include "dz_comp.h"

#ifdef DZ_CALIBRATION_WORDS
#include "bound.h"
#endif

void core_answers(const uint16_t *codes, uint32_t count, uint16_t *answers)
{
    for (uint32_t k = 0u; k < count; k++, codes += 3, answers += 2) {
        answers[0] = DZ_COMP(codes[0], codes[1], codes[2]);
        answers[1] = DZ_STATUS(codes[0], codes[1], codes[2]);
    }
}
