/* Prints a hash of what the line stage makes over many settings, the same on every machine and compiler; every NaN
 * counts as the same. Buffers have their exact size, so that sanitizers see what is beyond them. Exit code 1 if windows
 * one by one give other bits than all at once, or a wrong call is not refused. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arrays.h"
#include "livebode/lines.h"

#define ROWS 11u
#define WEIGHTS 6u

/* From integers alone, |x| < 4, and now and then not finite. */
static double noise(uint32_t *state)
{
    static const double zero = 0.0;
    *state = *state * 1664525u + 1013904223u;
    const double x = (double)((int32_t)(*state >> 12) - (1 << 19)) / 131072.0;
    return *state % 61u == 0u ? x / zero : *state % 67u == 0u ? zero / zero : x;
}

static double *noises(size_t count, uint32_t *state, int is_positive)
{
    double *found = reals(count);
    for (size_t i = 0; i < count; ++i) {
        const double x = noise(state);
        found[i] = is_positive && x < 0 ? -x : x;
    }
    return found;
}

static uint8_t *choices(size_t count, uint32_t *state)
{
    uint8_t *found = flags(count);
    for (size_t i = 0; i < count; ++i) {
        found[i] = noise(state) > -2.0;
    }
    return found;
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

static lb_line_moments moments_of(size_t places, size_t lines)
{
    lb_line_moments m = {places, lines, (int64_t *)claim(places, sizeof(int64_t)), NULL, NULL, NULL, NULL};
    m.means = reals(LB_LINE_MEANS * places * lines);
    m.scatter = reals(LB_LINE_SCATTER * places * lines);
    m.change = reals(LB_LINE_CHANGES * places * lines);
    m.moment = reals(LB_LINE_PLACE * places);
    return m;
}

static void release_moments(lb_line_moments *m)
{
    free(m->count);
    free(m->means);
    free(m->scatter);
    free(m->change);
    free(m->moment);
}

static lb_line_rows rows_of(size_t rows, size_t lines)
{
    const size_t n = rows * lines;
    const lb_line_rows out = {reals(2 * n), reals(n), reals(n),    reals(n),        reals(2 * n), reals(n),
                              reals(n),     flags(n), reals(rows), reals(3 * rows), flags(rows)};
    return out;
}

static uint64_t hash_of_rows(uint64_t hash, const lb_line_rows *out, size_t rows, size_t lines)
{
    const size_t n = rows * lines;
    const double *parts[] = {out->value,      out->sigma,     out->coherence, out->input_coherence, out->weight,
                             out->distortion, out->variation, out->dof,       out->moment};
    const size_t counts[] = {2 * n, n, n, n, 2 * n, n, n, rows, 3 * rows};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; ++i) {
        hash = hashed(hash, parts[i], counts[i]);
    }
    for (size_t i = 0; i < n; ++i) {
        hash = (hash ^ out->valid[i]) * 1099511628211u;
    }
    for (size_t i = 0; i < rows; ++i) {
        hash = (hash ^ out->usable[i]) * 1099511628211u;
    }
    return hash;
}

static void release_rows(lb_line_rows *out)
{
    free(out->value);
    free(out->sigma);
    free(out->coherence);
    free(out->input_coherence);
    free(out->weight);
    free(out->distortion);
    free(out->variation);
    free(out->valid);
    free(out->dof);
    free(out->moment);
    free(out->usable);
}

static uint64_t hash_of_moments(uint64_t hash, const lb_line_moments *m)
{
    hash = hashed(hash, m->means, LB_LINE_MEANS * m->places * m->lines);
    hash = hashed(hash, m->scatter, LB_LINE_SCATTER * m->places * m->lines);
    hash = hashed(hash, m->change, LB_LINE_CHANGES * m->places * m->lines);
    return hashed(hash, m->moment, LB_LINE_PLACE * m->places);
}

static const double table[LB_LINE_SUMS * WEIGHTS] = {
    0, 1, 1.5,   1.75,     1.875,       1.9375,         0, 1, 1.25, 1.3125, 1.328125, 1.33203125,
    0, 1, 1.125, 1.140625, 1.142578125, 1.142822265625, 0, 0, 0.5,  1.0,    1.375,    1.625,
    0, 0, 0.375, 0.875,    1.375,       1.75,           0, 0, 0.25, 0.5,    0.75,     0.875};

/* The window `row` of several. Its moment is a column, which is not contiguous. */
static void take_one(const lb_line_windows *in, size_t lines, size_t row, double *moment, lb_line_windows *one)
{
    *one = *in;
    one->rows = 1;
    one->output += 2 * row * in->stride;
    one->denominator += 2 * row * in->stride;
    one->reference += 2 * row * in->stride;
    one->noise = in->noise ? in->noise + row * lines : NULL;
    one->whole += row;
    one->clean += row;
    one->aside = in->aside ? in->aside + row : NULL;
    one->moving = in->moving ? in->moving + row : NULL;
    one->verdict = in->verdict ? in->verdict + row : NULL;
    for (size_t i = 0; i < 3; ++i) {
        moment[i] = in->moment[i * in->rows + row];
    }
    one->moment = moment;
}

/* One window after the other must change the moments as all at once do. */
static void demand_one_by_one(const lb_line_weights *weights, const lb_line_settings *set, const lb_line_windows *in,
                              const lb_line_moments *after, double largest_after)
{
    lb_line_moments m = moments_of(after->places, after->lines);
    double largest = 0, moment[3];
    for (size_t row = 0; row < in->rows; ++row) {
        lb_line_windows one;
        lb_line_rows out = rows_of(1, m.lines);
        take_one(in, m.lines, row, moment, &one);
        one.place = (in->place + row) % m.places;
        DEMAND(lb_lines_process(weights, &m, &largest, set, &one, &out) == LB_OK);
        release_rows(&out);
    }
    DEMAND(hash_of_moments(0, &m) == hash_of_moments(0, after));
    DEMAND(largest == largest_after || (largest != largest && largest_after != largest_after));
    release_moments(&m);
}

static uint64_t run(size_t lines, size_t places, unsigned options, lb_instruction_set instructions, uint64_t hash)
{
    uint32_t state = (uint32_t)(lines * 131u + places * 17u + options);
    const lb_line_weights weights = {options & 1u ? 1.0 : 0.5, options & 1u ? NULL : table, WEIGHTS};
    const lb_line_settings set = {
        (options & 2u) != 0,      (options & 4u) != 0, (lb_line_noise)(options / 8u % 3u), 2.5,
        options & 1u ? 3.0 : 1e9, instructions};
    const size_t stride = lines + options % 3u, n = ROWS * lines;
    double *output = noises(2 * ROWS * stride, &state, 0), *reference = noises(2 * ROWS * stride, &state, 0);
    double *detected = noises(n, &state, 1), *distortion = noises(n, &state, 1), *moment = noises(3 * ROWS, &state, 0);
    uint8_t *whole = choices(ROWS, &state), *clean = choices(ROWS, &state), *aside = choices(ROWS, &state);
    uint8_t *moving = choices(ROWS, &state), *invalid = choices(n, &state);
    int64_t *verdict = (int64_t *)claim(ROWS, sizeof(int64_t));
    for (size_t row = 0; row < ROWS; ++row) {
        verdict[row] = (int64_t)(row * row % ROWS);
    }
    const lb_line_windows in = {places - 1,
                                ROWS,
                                stride,
                                output,
                                options & 4u ? reference : output,
                                reference,
                                set.noise ? detected : NULL,
                                whole,
                                clean,
                                options & 2u ? aside : NULL,
                                set.noise ? moving : NULL,
                                options & 1u ? distortion : NULL,
                                options & 1u ? invalid : NULL,
                                options & 1u ? verdict : NULL,
                                ROWS,
                                moment};
    lb_line_moments m = moments_of(places, lines);
    lb_line_rows out = rows_of(ROWS, lines);
    double largest = 0;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &in, &out) == LB_OK);
    hash = hashed(hash_of_moments(hash_of_rows(hash, &out, ROWS, lines), &m), &largest, 1);
    demand_one_by_one(&weights, &set, &in, &m, largest);

    void *every[] = {output, reference, detected, distortion, moment, whole, clean, aside, moving, invalid, verdict};
    for (size_t i = 0; i < sizeof every / sizeof *every; ++i) {
        free(every[i]);
    }
    release_rows(&out);
    release_moments(&m);
    return hash;
}

static void refuse_misuse(void)
{
    const lb_line_weights weights = {0.5, table, WEIGHTS}, none = {0.5, NULL, 0};
    const lb_line_settings set = {0, 0, LB_NOISE_SCATTER, 1, 1, LB_BEST},
                           unknown = {0, 0, LB_NOISE_SCATTER, 1, 1, (lb_instruction_set)99};
    lb_line_moments m = moments_of(1, 2), missing = m;
    lb_line_rows out = rows_of(1, 2), partial = out;
    const double spectrum[4] = {1, 2, 3, 4}, moment[3] = {0};
    const uint8_t yes[1] = {1};
    const int64_t second[1] = {1}, before[1] = {-1};
    double largest = 0;
    lb_line_windows in = {0,   1,    2,    spectrum, spectrum, spectrum, NULL, yes,
                          yes, NULL, NULL, NULL,     NULL,     NULL,     0,    moment};
    lb_line_windows wrong = in;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &in, NULL) == LB_ERROR_NULL);
    DEMAND(lb_lines_process(&weights, &m, NULL, &set, &in, &out) == LB_ERROR_NULL);
    missing.means = NULL;
    DEMAND(lb_lines_process(&weights, &missing, &largest, &set, &in, &out) == LB_ERROR_NULL);
    partial.weight = NULL;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &in, &partial) == LB_ERROR_NULL);
    wrong.reference = NULL;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &wrong, &out) == LB_ERROR_NULL);
    wrong = in, wrong.place = 1;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &wrong, &out) == LB_ERROR_SIZE);
    wrong = in, wrong.stride = 1;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &wrong, &out) == LB_ERROR_SIZE);
    wrong = in, wrong.distortion = spectrum, wrong.verdicts = 1;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &wrong, &out) == LB_ERROR_NULL);
    wrong.verdict = second;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &wrong, &out) == LB_ERROR_SIZE);
    wrong.verdict = before;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &wrong, &out) == LB_ERROR_SIZE);
    wrong = in, wrong.invalid = yes;
    DEMAND(lb_lines_process(&weights, &m, &largest, &set, &wrong, &out) == LB_ERROR_NULL);
    DEMAND(lb_lines_process(&weights, &m, &largest, &unknown, &in, &out) == LB_ERROR_INSTRUCTION_SET);
    DEMAND(lb_lines_process(&none, &m, &largest, &set, &in, &out) == LB_ERROR_SIZE);
    DEMAND(m.count[0] == 0 && largest == 0);
    release_rows(&out);
    release_moments(&m);
}

int main(void)
{
    static const size_t lines[] = {1, 7, 32, 33, 70};
    uint64_t total = 14695981039346656037u;
    refuse_misuse();
    for (size_t i = 0; i < sizeof lines / sizeof *lines; ++i) {
        for (size_t places = 1; places <= 4; places += 1 + i % 2) {
            for (unsigned options = 0; options < 24; ++options) {
                const uint64_t found = run(lines[i], places, options, LB_BASELINE, total);
                for (int set = LB_BEST; set <= (int)lb_best_instruction_set(); ++set) {
                    DEMAND(run(lines[i], places, options, (lb_instruction_set)set, total) == found);
                }
                total = found;
            }
        }
    }
    printf("%016" PRIx64 "\n", total);
    return 0;
}
