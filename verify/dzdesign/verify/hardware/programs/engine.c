/* See engine.h. */
#include "engine.h"

#include <math.h>
#include <stddef.h>

#define MOST_CONVERSIONS 64u

struct pwm pwms[MODULES];
int64_t now, conversion_delay;
double sysclk_hz = 1e6, watchdog_s;
bool counters_run, watchdog_on, interrupts_on, halted, clock_lost;
uint8_t outside[GPIOS];

/* The module that a module's synchronisation comes from: 1 to 2 to 3, 1 to 4 to 5 to 6, and 1 to 7 to 8. */
static const int sync_from[MODULES] = {-1, 0, 1, 0, 3, 4, 0, 6};
static struct conversion conversions[MOST_CONVERSIONS];
static unsigned conversion_count;
static double served_s, clock_set_s;
static uint8_t level_before[GPIOS];
static bool free_before[GPIOS];

double seconds_now(void) { return clock_set_s + (double)now / sysclk_hz; }

int64_t counts_at(double seconds) { return (int64_t)ceil((seconds - clock_set_s) * sysclk_hz); }

void set_clock(double hz)
{
    if (hz != sysclk_hz)
    {
        clock_set_s = seconds_now();
        now = 0;
        sysclk_hz = hz;
        happened("clock", (unsigned)(hz + 0.5), 0u);
    }
}

void serve_watchdog(void)
{
    served_s = seconds_now();
    happened("service", 0u, 0u);
}

static uint32_t cycle_of(const struct pwm *pwm)
{
    return (pwm->counting == UP_DOWN) ? 2u * pwm->active_period : pwm->active_period + 1u;
}

/* Counts after 0 at which the counter has a value on its way up or down; beyond the cycle if it never has. */
static uint32_t place_of(const struct pwm *pwm, uint32_t value, bool down)
{
    const uint32_t never = cycle_of(pwm);

    if ((value > pwm->active_period) || (value == 0u))
    {
        return never; /* a compare value of 0 that is loaded at 0 misses its own event: SPRAAI1 */
    }
    switch (pwm->counting)
    {
    case UP: return down ? never : value;
    case DOWN: return down ? never - value : never;
    default: return down ? never - value : value;
    }
}

/* When the counter next comes to a place where something may happen. */
static int64_t next_of(const struct pwm *pwm)
{
    uint32_t next = cycle_of(pwm);
    const bool stops = (pwm->at_halt == STOPS_AT_ONCE) || ((pwm->at_halt == STOPS_AT_PERIOD) && (pwm->at == pwm->active_period));

    if (!pwm->counts || clock_lost || (halted && stops))
    {
        return NEVER;
    }
    for (unsigned place = 0u; place < 6u; place++)
    {
        const uint32_t value = (place < 2u) ? pwm->active_period : (place < 4u) ? pwm->active_compare : pwm->compare[1];
        const uint32_t at = place_of(pwm, value, (place % 2u) != 0u);

        next = ((at > pwm->at) && (at < next)) ? at : next;
    }
    return pwm->begun + (int64_t)next * pwm->divider;
}

static void force(struct pwm *pwm) { pwm->set = (pwm->active_force == SETS) || (pwm->set && (pwm->active_force != CLEARS)); }

unsigned level_of_pwm(const struct pwm *pwm)
{
    if (!pwm->tripped || (pwm->trip_action == NOT_FORCED))
    {
        return pwm->set ? HIGH : LOW;
    }
    return (pwm->trip_action == FORCED_LOW) ? LOW : (pwm->trip_action == FORCED_HIGH) ? HIGH : OPEN;
}

static void event(unsigned module, enum event what)
{
    struct pwm *const pwm = &pwms[module];
    const uint32_t action = pwm->action[what];

    pwm->set = (action == SETS) || ((action != CLEARS) && ((action == TOGGLES) != pwm->set));
    force(pwm);
    for (unsigned each = 0u; each < TRIGGERS; each++)
    {
        if (pwm->trigger[each].on && (pwm->trigger[each].event == (uint32_t)what) && (pwm->trigger[each].every > 0u) &&
            (++pwm->trigger[each].seen >= pwm->trigger[each].every))
        {
            pwm->trigger[each].seen = 0u;
            if (each == INTERRUPT)
            {
                pwm->interrupt_waits = pwm->interrupt_waits || !pwm->interrupt_flag;
                pwm->interrupt_flag = true;
            }
            else
            {
                start_conversions(module, (enum trigger)each);
            }
        }
    }
}

static void load(struct pwm *pwm, bool at_zero)
{
    pwm->active_period = (at_zero || pwm->period_at_once) ? pwm->period : pwm->active_period;
    pwm->active_compare = (at_zero || pwm->compare_at_once) ? pwm->compare[0] : pwm->active_compare;
    pwm->active_force = (at_zero || pwm->force_at_once) ? pwm->force : pwm->active_force;
    force(pwm);
}

static void arrive(unsigned module, uint32_t at);

static void synchronise(unsigned from)
{
    for (unsigned module = 0u; module < MODULES; module++)
    {
        struct pwm *const pwm = &pwms[module];

        if (sync_from[module] != (int)from)
        {
            continue;
        }
        if (pwm->in_phase && pwm->counts && !((pwm->at == pwm->phase) && (pwm->begun == now)))
        {
            pwm->begun = now - (int64_t)pwm->phase * pwm->divider;
            arrive(module, pwm->phase);
        }
        if (pwm->sync_out == 0u) /* what comes in goes out */
        {
            synchronise(module);
        }
    }
}

/* The counter is at a place of its cycle; of actions at once, the later one wins: zero, A, B, period. */
static void arrive(unsigned module, uint32_t at)
{
    struct pwm *const pwm = &pwms[module];

    pwm->at = at;
    if (at == 0u)
    {
        load(pwm, true);
        event(module, AT_ZERO);
    }
    for (unsigned down = 0u; down < 2u; down++)
    {
        if ((at != 0u) && (at == place_of(pwm, pwm->active_compare, down != 0u)))
        {
            event(module, (down != 0u) ? AT_A_DOWN : AT_A_UP);
        }
        if ((at != 0u) && (at == place_of(pwm, pwm->compare[1], down != 0u)))
        {
            event(module, (down != 0u) ? AT_B_DOWN : AT_B_UP);
        }
    }
    if (at == ((pwm->counting == DOWN) ? 0u : pwm->active_period))
    {
        event(module, AT_PERIOD);
    }
    if ((pwm->sync_out == 1u && at == 0u) || (pwm->sync_out == 2u && at == pwm->compare[1]))
    {
        synchronise(module);
    }
}

/* Registers have been written, or pins moved. */
void settle(void)
{
    unsigned signals;

    settle_registers();
    signals = trip_signals();
    for (unsigned module = MODULES; module-- > 0u;) /* what a module keeps in step starts before it */
    {
        struct pwm *const pwm = &pwms[module];
        const bool counted = pwm->counts;

        pwm->tripped = pwm->tripped || ((pwm->one_shot & signals) != 0u);
        load(pwm, false);
        pwm->counts = counters_run && (pwm->counting != STOPPED);
        if (pwm->counts && !counted)
        {
            pwm->begun = now - (int64_t)pwm->starts_at * pwm->divider;
            load(pwm, true);
            arrive(module, pwm->starts_at);
        }
    }
    settle_registers();
    for (unsigned gpio = 0u; gpio < GPIOS; gpio++)
    {
        const uint8_t level = (uint8_t)level_of(gpio);
        const int module = module_of(gpio);
        const bool is_free = (module >= 0) && !pwms[module].tripped; /* no trip zone holds it */

        if (level != level_before[gpio])
        {
            happened("pin", gpio, level);
        }
        level_before[gpio] = level;
        if (is_free != free_before[gpio])
        {
            happened("free", gpio, is_free);
        }
        free_before[gpio] = is_free;
    }
}

void convert(const struct conversion *conversion)
{
    if ((conversion_count < MOST_CONVERSIONS) && converter_hears(conversion->channel))
    {
        conversions[conversion_count] = *conversion;
        conversions[conversion_count].done += conversion_delay;
        conversion_count++;
    }
}

bool is_busy(unsigned group)
{
    for (unsigned each = 0u; each < conversion_count; each++)
    {
        if (conversions[each].group == group)
        {
            return true;
        }
    }
    return false;
}

static void convert_now(void)
{
    unsigned kept = 0u;

    for (unsigned each = 0u; each < conversion_count; each++)
    {
        struct conversion *const one = &conversions[each];

        if (!one->taken && (one->held <= now))
        {
            one->taken = true;
            one->code = code_at(one->channel);
            happened("hold", one->channel, one->code);
            one->code = (one->first && !one->last) ? FIRST_CODE : one->code;
        }
        if (one->done <= now)
        {
            converted(one);
        }
        else
        {
            conversions[kept] = *one;
            kept++;
        }
    }
    conversion_count = kept;
}

static void interrupt(void)
{
    for (unsigned module = 0u; module < MODULES; module++)
    {
        if (interrupts_on && processor_takes_interrupts() && pwms[module].interrupt_waits && interrupt_passes(module))
        {
            pwms[module].interrupt_waits = false;
            happened("interrupt", module + 1u, 0u);
            serve(module);
            after_interrupt();
            settle();
        }
    }
}

void run_until(int64_t until)
{
    settle();
    for (;;)
    {
        int64_t next = next_of_program();
        const int64_t bite = watchdog_on ? counts_at(served_s + watchdog_s) : NEVER;

        next = (bite < next) ? bite : next;
        for (unsigned each = 0u; each < conversion_count; each++)
        {
            const int64_t at = conversions[each].taken ? conversions[each].done : conversions[each].held;
            next = (at < next) ? at : next;
        }
        for (unsigned module = 0u; module < MODULES; module++)
        {
            const int64_t at = next_of(&pwms[module]);
            next = (at < next) ? at : next;
        }
        if (next > until)
        {
            break;
        }
        now = (next > now) ? next : now;
        if (watchdog_on && (bite <= now))
        {
            reset_by_watchdog();
        }
        if (next_of_program() <= now)
        {
            act();
            settle();
        }
        for (unsigned module = 0u; module < MODULES; module++)
        {
            struct pwm *const pwm = &pwms[module];

            if (next_of(pwm) <= now)
            {
                const uint32_t at = (uint32_t)((now - pwm->begun) / pwm->divider);
                pwm->begun += (at >= cycle_of(pwm)) ? (int64_t)cycle_of(pwm) * pwm->divider : 0;
                arrive(module, (at >= cycle_of(pwm)) ? 0u : at);
            }
        }
        convert_now();
        settle();
        interrupt();
    }
    now = (until > now) ? until : now;
}

void delay(double seconds) { run_until(now + (int64_t)(seconds * sysclk_hz)); }
