/* Included behind the headers of a core in block form: its functions are called like those of the fixed form, with the
 * block of `dz_bound`, an object of its own. */
#ifndef BOUND_H
#define BOUND_H

union dz_bound {
    uint16_t words[DZ_CALIBRATION_WORDS];
    struct dz_calibration block;
};

extern const union dz_bound dz_bound;

#define dz_comp(u, a, b) dz_comp(&dz_bound.block, (u), (a), (b))
#define dz_comp_negative(u, a, b) dz_comp_negative(&dz_bound.block, (u), (a), (b))
#define dz_status(u, a, b) dz_status(&dz_bound.block, (u), (a), (b))
#define dz_status_negative(u, a, b) dz_status_negative(&dz_bound.block, (u), (a), (b))
#define dz_beta(a, b) dz_beta(&dz_bound.block, (a), (b))
#define dz_beta_negative(a, b) dz_beta_negative(&dz_bound.block, (a), (b))
#define dz_drive_init(drive) dz_drive_init(&dz_bound.block, (drive))
#define dz_drive_sample(drive, ...) dz_drive_sample(&dz_bound.block, (drive), __VA_ARGS__)
#define dz_drive_tick(drive) dz_drive_tick(&dz_bound.block, (drive))
#define dz_current_init(loop) dz_current_init(&dz_bound.block, (loop))
#define dz_current_calibrate(loop, sum) dz_current_calibrate(&dz_bound.block, (loop), (sum))
#define dz_current_tick(loop, ...) dz_current_tick(&dz_bound.block, (loop), __VA_ARGS__)

#define DZ_DRIVE_COMMAND_ZERO (dz_bound.block.command_zero)
#define DZ_CURRENT_OFFSET_TICKS ((uint32_t)SHUNTS << dz_bound.block.current.offset_shift)

#endif
