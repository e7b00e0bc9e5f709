/*
 * Every pair of command and pressure drop: the function block's text, turned into C in block.h, against the exact law.
 *
 * The law comes as straight parts along the command, in whole numbers, for each side and pressure drop; its outputs are
 * made by additions alone. What the block remembers, the driven side and whether the command counts as zero, is followed
 * here from its description. A block is tried from every state near zero command, elsewhere from the first and from one of
 * the others in turn.
 */
#include <stdlib.h>
#include <string.h>

#include "block.h"

enum { PARTS = 3, NUMBERS = 7, SIDES = 2, STATES = 6 };

/* One side of the law; its pressure drops are first_drop and on, and one more row is of pressures that can't be right. */
struct side
{
    int64_t sign, along, span, zero_band, has_rest, leave_zero, limit, turn, reverse, tested_to, first_drop, drops;
};

struct sensor
{
    int64_t low, high, zero, weight;
};

struct setup
{
    int64_t sides, command_zero, command_low, command_high, unit;
    struct sensor a, b;
    struct side side[SIDES];
};

struct result
{
    int64_t pairs, calls, wrong, wrong_status, wrong_state;
    struct faults faults;
    int64_t command, pressure_a, pressure_b, found, expected, hash;
};

/* The law, kept from prepare() on, and the numbers of its parts. */
static struct setup kept;
static const int64_t *kept_parts[SIDES];

/* What is remembered, as its description has it. */
struct memory
{
    int64_t side, at_rest;
};

struct answer
{
    int64_t side, output, status;
};

static int64_t floored(int64_t x, int64_t y)
{
    return x / y - (x % y < 0);
}

static const struct side *side_of(const struct setup *setup, int64_t sign)
{
    return &setup->side[sign < 0 ? 1 : 0];
}

static int64_t drop_of(const struct setup *setup, const struct side *side, int64_t a, int64_t b)
{
    return floored(side->turn * ((a - setup->a.zero) * setup->a.weight - (b - setup->b.zero) * setup->b.weight),
                   setup->unit);
}

static int valid(const struct sensor *sensor, int64_t x)
{
    return x >= sensor->low && x <= sensor->high;
}

static const int64_t *parts_of(const struct side *side, int64_t row)
{
    return kept_parts[side - kept.side] + row * PARTS * NUMBERS;
}

/* Outputs of one row, of every command from zero to full. */
static void fill(const struct side *side, int64_t row, int64_t *outputs)
{
    for (int part = 0; part < PARTS; part++) {
        const int64_t *p = parts_of(side, row) + part * NUMBERS;
        int64_t whole = p[2], rest = p[3];
        for (int64_t command = p[0]; command <= p[1]; command++) {
            outputs[command] = whole < 0 ? 0 : whole > side->limit ? side->limit : whole;
            whole += p[4];
            rest += p[5];
            if (rest >= p[6]) {
                rest -= p[6];
                whole++;
            }
        }
    }
}

/* Output at zero command of a row. */
static int64_t at_zero(const struct side *side, int64_t row)
{
    const int64_t whole = parts_of(side, row)[2];
    return whole < 0 ? 0 : whole > side->limit ? side->limit : whole;
}

static int64_t row_of(const struct setup *setup, const struct side *side, int64_t a, int64_t b, int64_t *status)
{
    const int sound_a = valid(&setup->a, a), sound_b = valid(&setup->b, b);
    *status += (sound_a ? 0 : 2) + (sound_b ? 0 : 4);
    if (sound_a && sound_b) {
        const int64_t drop = drop_of(setup, side, a, b);
        *status += drop < -side->reverse ? 8 : drop > side->tested_to ? 16 : 0;
        if (drop >= -side->reverse) {
            return drop - side->first_drop;
        }
    }
    return side->drops;
}

/* What a block must give; `known` are the outputs of one row of one side, else only zero command can be asked for. */
static struct answer expected(const struct setup *setup, struct memory *memory, int64_t command, int64_t a, int64_t b,
                              const struct side *of, int64_t row_known, const int64_t *known)
{
    struct answer answer = {0, 0, 0};
    const int sound = command >= setup->command_low && command <= setup->command_high;
    const int64_t away = sound ? setup->side[0].along * (command - setup->command_zero) : 0;
    const struct side *side;
    int64_t towards, row;

    if (setup->sides == 2) {
        if (!sound) {
            memory->side = 0;
        } else if (away > setup->side[0].leave_zero) {
            memory->side = 1;
        } else if (-away > setup->side[1].leave_zero) {
            memory->side = -1;
        }
    }
    side = side_of(setup, memory->side);
    towards = memory->side < 0 ? -away : away;
    towards = towards < 0 ? 0 : towards > side->span ? side->span : towards;
    if (side->has_rest) {
        if (towards > side->leave_zero) {
            memory->at_rest = 0;
        }
        if (towards <= side->zero_band) {
            memory->at_rest = 1;
        }
        towards = memory->at_rest ? 0 : towards;
    }
    answer.status = sound ? 0 : 1;
    row = row_of(setup, side, a, b, &answer.status);
    answer.side = memory->side;
    if (sound && memory->side != 0) {
        if (towards == 0) {
            answer.output = at_zero(side, row);
        } else if (side == of && row == row_known) {
            answer.output = known[towards];
        } else {
            answer.output = -1; /* never asked for */
        }
    }
    return answer;
}

/* Call the block from a state; compare all that it gives. */
static void compare(const struct setup *setup, const struct memory *from, int64_t command, int64_t a, int64_t b,
                    const struct side *of, int64_t row, const int64_t *known, struct result *result)
{
    const int64_t inputs[3] = {command, a, b};
    int64_t state[STATE + 1] = {0}, outputs[OUTPUTS], place = 0;
    struct memory memory = *from;
    const struct answer must = expected(setup, &memory, command, a, b, of, row, known);
    const int64_t out_a = must.side < 0 ? 0 : must.output, out_b = must.side < 0 ? must.output : 0;
    int wrong, wrong_state;

    if (setup->sides == 2) {
        state[place++] = from->side;
    }
    if (setup->side[0].has_rest) {
        state[place] = from->at_rest;
    }
    block(inputs, state, outputs, &result->faults);
    wrong = outputs[0] != out_a || (setup->sides == 2 && outputs[1] != out_b);
    place = 0;
    wrong_state = setup->sides == 2 && state[place++] != memory.side;
    wrong_state = wrong_state || (setup->side[0].has_rest && state[place] != memory.at_rest);
    result->calls++;
    result->wrong_status += outputs[OUTPUTS - 1] != must.status;
    result->wrong_state += wrong_state;
    if (wrong) {
        if (result->wrong == 0) {
            result->command = command;
            result->pressure_a = a;
            result->pressure_b = b;
            result->found = must.side < 0 ? outputs[1] : outputs[0];
            result->expected = must.output;
        }
        result->wrong++;
    }
    result->hash = (int64_t)(((uint64_t)result->hash ^ (uint64_t)(outputs[0] + (outputs[OUTPUTS - 2] << 20))) *
                             UINT64_C(1099511628211));
}

/* States that a block can be in: the first is a new instance's. */
static int states_of(const struct setup *setup, struct memory *states)
{
    const int both = setup->sides == 2, rests = (int)setup->side[0].has_rest;
    static const int64_t sides[3] = {0, 1, -1};
    int count = 0;
    for (int place = both ? 0 : 1; place < (both ? 3 : 2); place++) {
        for (int64_t at_rest = rests; at_rest >= 0; at_rest--) {
            states[count].side = sides[place];
            states[count].at_rest = at_rest;
            count++;
        }
    }
    return count;
}

/* The valid pressures that make a drop of a side, as numbers of B; where there are none, those of `low` to `high`. */
static int64_t pairs_of(const struct setup *setup, const struct side *side, int64_t drop, int64_t low, int64_t high,
                        int64_t *a, int64_t *b)
{
    int64_t count = 0;
    for (int any = 0; any < 2 && count == 0; any++) {
        for (int64_t y = any ? low : setup->b.low; y <= (any ? high : setup->b.high); y++) {
            const int64_t weighted = (y - setup->b.zero) * setup->b.weight;
            const int64_t x = setup->a.zero + (side->turn > 0 ? drop - floored(-weighted, setup->unit)
                                                              : floored(weighted, setup->unit) - drop);
            if (drop_of(setup, side, x, y) == drop && (any ? x >= low && x <= high : valid(&setup->a, x))) {
                a[count] = x;
                b[count++] = y;
            }
        }
    }
    return count;
}

static const int64_t *copied(const int64_t *numbers, int64_t count)
{
    int64_t *copy = malloc((size_t)count * sizeof *copy + 1u);
    if (copy != NULL) {
        memcpy(copy, numbers, (size_t)count * sizeof *copy);
    }
    return copy;
}

/* Keep the law and the numbers of its parts, of each side; not 0: there is no memory. */
int32_t prepare(const struct setup *setup, const int64_t *first, int64_t firsts, const int64_t *second, int64_t seconds)
{
    kept = *setup;
    kept_parts[0] = copied(first, firsts);
    kept_parts[1] = copied(second, seconds);
    return kept_parts[0] == NULL || kept_parts[1] == NULL;
}

/* Try every command of one side at some of its pressure drops, from `first` to before `end`. */
int32_t every_command(int64_t which, int64_t first, int64_t end, int64_t low, int64_t high, struct result *result)
{
    const struct setup *setup = &kept;
    const struct side *side = &setup->side[which];
    const int64_t size = high - low + 1 + setup->b.high - setup->b.low;
    int64_t *known = calloc((size_t)side->span + 1, sizeof *known);
    int64_t *a = calloc((size_t)size + 1, sizeof *a), *b = calloc((size_t)size + 1, sizeof *b);
    struct memory states[STATES];
    const int count = states_of(setup, states);

    if (known == NULL || a == NULL || b == NULL) {
        return 1;
    }
    for (int64_t drop = first; drop < end; drop++) {
        const int64_t pairs = pairs_of(setup, side, drop, low, high, a, b);
        int64_t place = 0, status = 0, row;
        if (pairs == 0) {
            continue;
        }
        row = row_of(setup, side, a[0], b[0], &status);
        fill(side, row, known);
        for (int64_t command = setup->command_low; command <= setup->command_high; command++) {
            const int64_t towards = side->along * (command - setup->command_zero);
            if (setup->sides == 2 && towards < 0) {
                continue;
            }
            result->pairs++;
            const int other = count > 1 ? 1 + (int)(result->pairs % (count - 1)) : 0;
            for (int each = 0; each < count; each++) {
                if (each == 0 || each == other || towards <= side->leave_zero + 1) {
                    compare(setup, &states[each], command, a[place], b[place], side, row, known, result);
                }
            }
            place = place + 1 < pairs ? place + 1 : 0;
        }
    }
    free(known);
    free(a);
    free(b);
    return 0;
}

/* Try every pair of pressures from `low` to `high` at zero command, from every state; A runs from `first`. */
void every_pressure(int64_t first, int64_t end, int64_t low, int64_t high, struct result *result)
{
    const struct setup *setup = &kept;
    struct memory states[STATES];
    const int count = states_of(setup, states);
    for (int64_t a = first; a < end; a++) {
        for (int64_t b = low; b <= high; b++) {
            result->pairs++;
            for (int each = 0; each < count; each++) {
                compare(setup, &states[each], setup->command_zero, a, b, NULL, 0, NULL, result);
            }
        }
    }
}

/* Try some inputs of any size, three numbers each; none may ask for more than zero command. */
void any_inputs(const int64_t *inputs, int64_t number, struct result *result)
{
    const struct setup *setup = &kept;
    struct memory states[STATES];
    const int count = states_of(setup, states);
    for (int64_t each = 0; each < number; each++, inputs += 3) {
        result->pairs++;
        for (int state = 0; state < count; state++) {
            compare(setup, &states[state], inputs[0], inputs[1], inputs[2], NULL, 0, NULL, result);
        }
    }
}

/* Outputs, status and what is remembered, as they are, of some inputs and memories. */
void as_it_is(const int64_t *inputs, int64_t *states, int64_t *outputs, int64_t number, struct faults *faults)
{
    for (int64_t each = 0; each < number; each++) {
        block(inputs + 3 * each, states + STATE * each, outputs + OUTPUTS * each, faults);
    }
}
