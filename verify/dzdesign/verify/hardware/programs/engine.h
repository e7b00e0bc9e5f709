/* What the devices have in common: ePWM counters, trip zones, converter, watchdog and pins, in time. A device's file keeps
 * `pwms` as its registers say, the main program gives the inputs, and what happens is logged. Times are counts of
 * SYSCLKOUT since that clock was last set. */
#ifndef ENGINE_H
#define ENGINE_H

#include <stdbool.h>
#include <stdint.h>

#define MODULES 8u
#define GPIOS 64u
#define CHANNELS 16u
#define NEVER INT64_MAX
#define FIRST_CODE 0x0FFFu /* of the first conversion of a sequence: it may be anything */

/* Events of a counter, by the numbers that ETSEL has for them. */
enum event { AT_ZERO = 1, AT_PERIOD = 2, AT_A_UP = 4, AT_A_DOWN = 5, AT_B_UP = 6, AT_B_DOWN = 7 };
enum action { NO_ACTION, CLEARS, SETS, TOGGLES };
enum counting { UP, DOWN, UP_DOWN, STOPPED };
enum trigger { SOC_A, SOC_B, INTERRUPT, TRIGGERS };
enum trip_action { FLOATS, FORCED_HIGH, FORCED_LOW, NOT_FORCED };
enum level { LOW, HIGH, OPEN };
enum at_halt { STOPS_AT_ONCE, STOPS_AT_PERIOD }; /* what a debugger's halt does to a counter; else it runs on */

struct pwm
{
    /* As the registers say. */
    uint32_t counting, divider, period, compare[2], phase, sync_out, force, trip_action, one_shot, at_halt;
    bool period_at_once, compare_at_once, force_at_once, in_phase;
    uint32_t action[8]; /* by event */
    struct
    {
        bool on;
        uint32_t event, every, seen;
    } trigger[TRIGGERS];
    /* The module itself. */
    uint32_t active_period, active_compare, active_force, at;
    int64_t begun; /* when its counter was 0 */
    uint32_t starts_at;
    bool counts, tripped, set, interrupt_flag, interrupt_waits;
};

struct conversion
{
    unsigned group, slot, channel;
    int64_t held, done;
    uint16_t code;
    bool first, last, taken;
};

extern struct pwm pwms[MODULES];
extern int64_t now;
extern double sysclk_hz;
extern bool counters_run, watchdog_on, interrupts_on;
extern bool halted, clock_lost; /* by a debugger; the device stands still, but for what needs no clock */
extern double watchdog_s;
extern int64_t conversion_delay; /* so much later a converter is done */
extern uint8_t outside[GPIOS]; /* enum level of what is wired to a pin */

/* Of the main program. */
uint16_t code_at(unsigned channel);
bool converter_hears(unsigned channel), processor_takes_interrupts(void);
void after_interrupt(void);
int64_t next_of_program(void); /* when it acts next, and what it does then */
void act(void);
void happened(const char *what, unsigned one, unsigned two);
void reset_by_watchdog(void);

/* Of the device. */
void settle_registers(void); /* `pwms` as they are now, and what the registers show of the modules */
unsigned trip_signals(void); /* bit n: TZ(n + 1) is low */
unsigned level_of(unsigned gpio);
int module_of(unsigned gpio); /* whose output A is on a pin, or -1 */
void start_conversions(unsigned module, enum trigger trigger);
void converted(const struct conversion *conversion);
void receive(unsigned gpio, uint8_t octet); /* of a serial line */
bool interrupt_passes(unsigned module); /* and then it is blocked */
void serve(unsigned module);
void power_up(bool after_watchdog, bool without_crystal, double crystal_hz);

void set_clock(double hz);
double seconds_now(void);
int64_t counts_at(double seconds);
void delay(double seconds);
void run_until(int64_t until);
void settle(void);
void serve_watchdog(void);
void convert(const struct conversion *conversion);
bool is_busy(unsigned group);
unsigned level_of_pwm(const struct pwm *pwm);

#endif
