/* Prints a hash of what the matrix stage makes over many sizes, the same on every machine and compiler; every NaN
 * counts as the same. Buffers have their exact size, so that sanitizers see what is beyond them. Exit code 1 if an
 * instruction set, or windows one by one, give other bits, or a wrong call is not refused. */
#include <inttypes.h>
#include <string.h>

#include "arrays.h"
#include "livebode/matrix.h"

#define ROWS 13u

typedef struct {
    lb_matrix_settings set;
    lb_matrix_history history;
    lb_matrix_windows in;
    lb_matrix_rows out;
    size_t signals;
    double *spectrum;
    int64_t *row;
    uint8_t *clean;
} trial;

/* From integers alone, |x| < 4. */
static double noise(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)((int32_t)(*state >> 12) - (1 << 19)) / 131072.0;
}

static lb_matrix_rows rows_of(const lb_matrix_settings *s)
{
    const size_t n = ROWS * s->lines;
    const lb_matrix_rows out = {.value = reals(2 * n * s->outputs * s->inputs),
                                .noise = reals(2 * n * s->outputs * s->outputs),
                                .spread = reals(2 * n * s->inputs * s->inputs),
                                .coherence = reals(n * s->outputs),
                                .condition = reals(n),
                                .dof = reals(ROWS),
                                .complete = (int64_t *)claim(ROWS, sizeof(int64_t)),
                                .sure = flags(n)};
    return out;
}

static trial begin(const lb_matrix_settings *set)
{
    trial t = {.set = *set, .signals = set->outputs + set->inputs + set->beside, .out = rows_of(set)};
    const size_t length = set->experiments * set->repetitions * set->places + ROWS, stride = set->lines + 1u;
    uint32_t state = (uint32_t)(set->lines * 131u + set->inputs * 17u + set->experiments);
    t.history = (lb_matrix_history){length, reals(length * t.signals * 2u * set->lines), flags(length),
                                    reals(3u * set->inputs * set->lines)};
    t.spectrum = reals(2u * t.signals * ROWS * stride);
    for (size_t i = 0; i < 2u * t.signals * ROWS * stride; ++i) {
        t.spectrum[i] = noise(&state);
    }
    t.row = (int64_t *)claim(ROWS, sizeof(int64_t));
    t.clean = flags(ROWS);
    for (size_t i = 0; i < ROWS; ++i) {
        t.row[i] = (int64_t)i;
        t.clean[i] = i != 3u;
    }
    t.in = (lb_matrix_windows){length - 2u, ROWS, ROWS, stride, t.spectrum, t.row, t.clean};
    return t;
}

static void end(trial *t)
{
    void *every[] = {
        t->history.spectrum, t->history.complete, t->history.work, t->spectrum,      t->row,           t->clean,
        t->out.value,        t->out.noise,        t->out.spread,   t->out.coherence, t->out.condition, t->out.dof,
        t->out.complete,     t->out.sure};
    for (size_t i = 0; i < sizeof every / sizeof *every; ++i) {
        free(every[i]);
    }
}

static uint64_t hashed(uint64_t hash, const double *data, size_t count)
{
    for (size_t i = 0; i < count; ++i) {
        uint64_t bits = 1;
        if (data[i] == data[i]) {
            memcpy(&bits, data + i, sizeof bits);
        }
        hash = (hash ^ bits) * 1099511628211u;
    }
    return hash;
}

static uint64_t hash_of(uint64_t hash, const trial *t)
{
    const lb_matrix_settings *s = &t->set;
    const size_t n = ROWS * s->lines;
    hash = hashed(hash, t->out.value, 2 * n * s->outputs * s->inputs);
    hash = hashed(hash, t->out.noise, 2 * n * s->outputs * s->outputs);
    hash = hashed(hash, t->out.spread, 2 * n * s->inputs * s->inputs);
    hash = hashed(hash, t->out.coherence, n * s->outputs);
    hash = hashed(hashed(hash, t->out.condition, n), t->out.dof, ROWS);
    for (size_t i = 0; i < n; ++i) {
        hash = (hash ^ t->out.sure[i]) * 1099511628211u;
    }
    for (size_t i = 0; i < ROWS; ++i) {
        hash = (hash ^ (uint64_t)t->out.complete[i]) * 1099511628211u;
    }
    return hash;
}

static uint64_t together(uint64_t hash, const lb_matrix_settings *set)
{
    trial t = begin(set);
    DEMAND(lb_matrix_process(&t.set, &t.history, &t.in, &t.out) == LB_OK);
    hash = hash_of(hash, &t);
    end(&t);
    return hash;
}

static uint64_t one_by_one(uint64_t hash, const lb_matrix_settings *set)
{
    trial t = begin(set);
    const size_t n = set->lines, o = set->outputs, i = set->inputs;
    for (size_t row = 0; row < ROWS; ++row) {
        lb_matrix_windows one = t.in;
        one.first = (t.in.first + row) % t.history.length;
        one.rows = 1;
        one.row += row;
        const lb_matrix_rows out = {t.out.value + 2 * row * n * o * i,
                                    t.out.noise + 2 * row * n * o * o,
                                    t.out.spread + 2 * row * n * i * i,
                                    t.out.coherence + row * n * o,
                                    t.out.condition + row * n,
                                    t.out.dof + row,
                                    t.out.complete + row,
                                    t.out.sure + row * n};
        DEMAND(lb_matrix_process(&t.set, &t.history, &one, &out) == LB_OK);
    }
    hash = hash_of(hash, &t);
    end(&t);
    return hash;
}

static void refuse_misuse(void)
{
    const lb_matrix_settings set = {2, 2, 3, 0, 2, 2, 1, 0, 0, 1e3, LB_BEST};
    trial t = begin(&set);
    lb_matrix_settings wrong[6];
    for (size_t i = 0; i < 6u; ++i) {
        wrong[i] = set;
    }
    wrong[0].outputs = LB_MATRIX_MOST + 1u;
    wrong[1].inputs = 0;
    wrong[2].lines = 0;
    wrong[3].repetitions = 3;
    wrong[4].places = (size_t)1 << 21;
    wrong[5].beside = (size_t)-1;
    for (size_t i = 0; i < 6u; ++i) {
        DEMAND(lb_matrix_process(&wrong[i], &t.history, &t.in, &t.out) == LB_ERROR_SIZE);
    }
    lb_matrix_windows outside = t.in;
    outside.first = t.history.length;
    DEMAND(lb_matrix_process(&set, &t.history, &outside, &t.out) == LB_ERROR_SIZE);
    t.row[4] = ROWS;
    DEMAND(lb_matrix_process(&set, &t.history, &t.in, &t.out) == LB_ERROR_SIZE);
    t.row[4] = 4;
    wrong[0] = set;
    wrong[0].set = (lb_instruction_set)99;
    DEMAND(lb_matrix_process(&wrong[0], &t.history, &t.in, &t.out) == LB_ERROR_INSTRUCTION_SET);
    lb_matrix_rows missing = t.out;
    missing.noise = NULL;
    DEMAND(lb_matrix_process(&set, &t.history, &t.in, &missing) == LB_ERROR_NULL);
    DEMAND(lb_matrix_process(NULL, &t.history, &t.in, &t.out) == LB_ERROR_NULL);
    end(&t);
}

int main(void)
{
    static const size_t lines[] = {1, 7, 9}, sizes[][3] = {{1, 1, 1}, {2, 2, 2}, {3, 2, 4}, {8, 8, 1}, {1, 4, 9}};
    uint64_t total = 14695981039346656037u;
    refuse_misuse();
    for (size_t i = 0; i < 15u; ++i) {
        for (int options = 0; options < 4; ++options) {
            const size_t *size = sizes[i % 5u];
            lb_matrix_settings set = {.outputs = size[0],
                                      .inputs = size[1],
                                      .experiments = size[2],
                                      .lines = lines[i / 5u],
                                      .beside = i % 2u,
                                      .repetitions = size[2] == 1u ? 9u : 3u,
                                      .places = 1u + i % 2u,
                                      .average = options & 1,
                                      .means = options & 2,
                                      .condition_max = 1e3,
                                      .set = LB_BASELINE};
            const uint64_t found = together(total, &set);
            DEMAND(one_by_one(total, &set) == found);
            for (int which = LB_BEST; which <= (int)lb_best_instruction_set(); ++which) {
                set.set = (lb_instruction_set)which;
                DEMAND(together(total, &set) == found);
            }
            total = found;
        }
    }
    printf("%016" PRIx64 "\n", total);
    return 0;
}
