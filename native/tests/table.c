/* Prints a hash of numbers read from random text and random runs, the same on every machine and compiler. Buffers have
 * their exact size, so that sanitizers see what is beyond them. Exit code 1 if a number that is written is not read
 * with the same bits, or a wrong call is not refused. */
#include <inttypes.h>
#include <string.h>

#include "arrays.h"
#include "livebode/table.h"

#define LIMBS 28u /* of 32 bits, the lowest first: enough for 5^342 · 2^32 */
#define ROWS 8u

static uint32_t next(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

static int is_below(const uint32_t *a, const uint32_t *b)
{
    for (size_t i = LIMBS; i-- > 0;) {
        if (a[i] != b[i]) {
            return a[i] < b[i];
        }
    }
    return 0;
}

static void subtract(uint32_t *a, const uint32_t *b)
{
    int64_t carry = 0;
    for (size_t i = 0; i < LIMBS; ++i) {
        carry += (int64_t)a[i] - b[i];
        a[i] = (uint32_t)carry;
        carry = carry < 0 ? -1 : 0;
    }
}

static void times(uint32_t *a, uint32_t factor)
{
    uint64_t carry = 0;
    for (size_t i = 0; i < LIMBS; ++i) {
        carry += (uint64_t)a[i] * factor;
        a[i] = (uint32_t)carry;
        carry >>= 32;
    }
}

static size_t bits_of(const uint32_t *a)
{
    size_t bits = 32u * LIMBS;
    while (!(a[(bits - 1) / 32] >> (bits - 1) % 32 & 1u)) {
        --bits;
    }
    return bits;
}

/* The first 128 bits of 1 / a, rounded up, and of a, rounded down. */
static void halves(const uint32_t *a, uint64_t *below, uint64_t *above)
{
    const size_t bits = bits_of(a);
    uint32_t rest[LIMBS] = {0};
    rest[(bits - 1) / 32] = (uint32_t)1 << (bits - 1) % 32;
    below[0] = below[1] = above[0] = above[1] = 0;
    for (size_t i = 0; i < 128; ++i) {
        times(rest, 2);
        const int fits = !is_below(rest, a);
        if (fits) {
            subtract(rest, a);
        }
        below[i / 64] = below[i / 64] << 1 | (uint64_t)fits;
        above[i / 64] = above[i / 64] << 1 | (i < bits ? a[(bits - 1 - i) / 32] >> (bits - 1 - i) % 32 & 1u : 0u);
    }
    below[0] += ++below[1] == 0;
}

static uint64_t *powers_of_ten(void)
{
    uint64_t *powers = (uint64_t *)claim((size_t)2 * LB_POWERS, sizeof(uint64_t)), unused[2];
    uint32_t five[LIMBS] = {1};
    for (int q = 0; q <= -LB_POWER_FIRST; ++q) {
        uint64_t *below = powers + 2 * (-q - LB_POWER_FIRST), *above = powers + 2 * (q - LB_POWER_FIRST);
        halves(five, q ? below : unused, q <= LB_POWER_LAST ? above : unused);
        times(five, 5);
    }
    return powers;
}

static const uint8_t kinds[3] = {LB_CELL_NUMBER, LB_CELL_SKIPPED, LB_CELL_MOMENT}, empty[6] = "NA\0no";

static lb_table_layout layout_of(const uint64_t *powers, uint32_t seed)
{
    const lb_table_layout found = {
        powers,       1 + seed % 3, kinds, empty, sizeof empty, 100, ';', seed % 2 ? ',' : '.', seed % 5 ? '"' : 0,
        seed % 7 == 0};
    return found;
}

/* Parts of rows, in any order. */
static size_t fill(uint8_t *text, size_t length, uint32_t *state)
{
    static const char *const parts[] = {"1",
                                        "25",
                                        ".5",
                                        ",5",
                                        "-",
                                        "+",
                                        "e9",
                                        "E-300",
                                        "1e-320",
                                        "9007199254740993",
                                        "123456789012345678901",
                                        " ",
                                        "\t",
                                        ";",
                                        ";",
                                        "\n",
                                        "\n",
                                        "\r\n",
                                        "\"",
                                        "NA",
                                        "nan",
                                        "-inf",
                                        "x",
                                        "\"\"",
                                        "2024-02-29 12:30:15",
                                        ".000250",
                                        "Z",
                                        "+01:00"};
    size_t at = 0;
    while (at < length) {
        const char *part = parts[next(state) % (sizeof parts / sizeof *parts)];
        const size_t count = strlen(part) < length - at ? strlen(part) : length - at;
        memcpy(text + at, part, count);
        at += count;
    }
    return at;
}

static uint64_t hash_of_random_rows(const uint64_t *powers, uint32_t seed, uint64_t hash)
{
    uint32_t state = seed;
    const lb_table_layout layout = layout_of(powers, seed);
    const size_t length = 1 + next(&state) % 90, wanted = layout.width - (layout.width > 1);
    uint8_t *text = flags(length);
    double *out = reals(wanted * ROWS);
    fill(text, length, &state);
    size_t rows = 0, used = 0;
    for (size_t begin = 0; begin < length && rows < ROWS; begin += used + 1) {
        const size_t before = rows;
        DEMAND(lb_table_read(&layout, text + begin, length - begin, ROWS, out, &rows, &used) == LB_OK);
        DEMAND(rows >= before && rows <= ROWS && used <= length - begin);
    }
    for (size_t i = 0; i < wanted * ROWS; ++i) {
        uint64_t bits;
        memcpy(&bits, out + i, sizeof bits);
        hash = (hash ^ (i % ROWS < rows ? bits : 0)) * 1099511628211u;
    }
    free(text), free(out);
    return hash;
}

/* Any finite double must come back. */
static void demand_round_trip(const uint64_t *powers, uint32_t seed)
{
    uint32_t state = seed;
    double *numbers = reals(ROWS), *back = reals(ROWS);
    int64_t *integers = (int64_t *)claim(ROWS, sizeof(int64_t)), ends[2] = {0, 1};
    for (size_t i = 0; i < ROWS; ++i) {
        const uint64_t bits = (uint64_t)next(&state) << 40 ^ (uint64_t)next(&state) << 20 ^ next(&state);
        memcpy(numbers + i, &bits, sizeof bits);
        numbers[i] = numbers[i] - numbers[i] == 0.0 ? numbers[i] : (double)i;
        integers[i] = 0;
    }
    const lb_table_column columns[2] = {{numbers, NULL, NULL}, {NULL, NULL, integers}};
    const lb_table_words words = {(const uint8_t *)"a", ends, 1};
    const size_t room = ROWS * (LB_NUMBER_BYTES + 2u);
    uint8_t *text = flags(room);
    size_t length = 0, rows = 0, used = 0;
    DEMAND(lb_table_write(powers, columns, 2, &words, ROWS, text, room, &length) == LB_OK);
    lb_table_layout layout = layout_of(powers, 1);
    layout.delimiter = ',', layout.decimal = '.';
    DEMAND(lb_table_read(&layout, text, length, ROWS, back, &rows, &used) == LB_OK);
    DEMAND(rows == ROWS && used + 1 >= length && memcmp(back, numbers, ROWS * sizeof *back) == 0);
    DEMAND(lb_table_write(powers, columns, 2, &words, ROWS, text, room - 1, &length) == LB_ERROR_MEMORY);
    integers[1] = 1;
    DEMAND(lb_table_write(powers, columns, 2, &words, ROWS, text, room, &length) == LB_ERROR_SIZE);
    free(numbers), free(back), free(integers), free(text);
}

static uint64_t hash_of_random_runs(uint32_t seed, uint64_t hash)
{
    uint32_t state = seed;
    const size_t length = 1u + next(&state) % 40u, count = 1u + next(&state) % 200u;
    const unsigned width = next(&state) % (LB_RUN_WIDTH_MAX + 1u);
    uint8_t *data = flags(length);
    uint32_t *out = (uint32_t *)claim(count, sizeof(uint32_t));
    for (size_t i = 0; i < length; ++i) {
        data[i] = (uint8_t)(next(&state) % (i % 8u ? 256u : 64u)); /* short runs, and some that are too long */
    }
    const lb_status status = lb_runs_decode(data, length, width, count, out);
    DEMAND(status == LB_OK || status == LB_ERROR_SIZE);
    for (size_t i = 0; status == LB_OK && i < count; ++i) {
        hash = (hash ^ out[i]) * 1099511628211u;
    }
    DEMAND(lb_runs_decode(data, length, LB_RUN_WIDTH_MAX + 1u, count, out) == LB_ERROR_SIZE);
    free(data), free(out);
    return hash;
}

static void refuse_misuse(const uint64_t *powers)
{
    lb_table_layout layout = layout_of(powers, 1), missing = layout;
    double out[ROWS];
    size_t rows = 0, used = 0;
    DEMAND(lb_table_read(NULL, empty, 1, ROWS, out, &rows, &used) == LB_ERROR_NULL);
    DEMAND(lb_table_read(&layout, NULL, 1, ROWS, out, &rows, &used) == LB_ERROR_NULL);
    missing.powers = NULL;
    DEMAND(lb_table_read(&missing, empty, 1, ROWS, out, &rows, &used) == LB_ERROR_NULL);
    layout.width = 0;
    DEMAND(lb_table_read(&layout, empty, 1, ROWS, out, &rows, &used) == LB_ERROR_SIZE);
    uint8_t text[1];
    uint32_t integers[1];
    DEMAND(lb_runs_decode(NULL, 1, 1, 1, integers) == LB_ERROR_NULL);
    DEMAND(lb_runs_decode(empty, 1, 1, 1, NULL) == LB_ERROR_NULL);
    DEMAND(lb_table_write(powers, NULL, 1, NULL, 1, text, 1, &used) == LB_ERROR_NULL);
}

int main(void)
{
    uint64_t *powers = powers_of_ten(), total = 14695981039346656037u;
    refuse_misuse(powers);
    for (uint32_t seed = 1; seed < 3000; ++seed) {
        total = hash_of_random_rows(powers, seed, total);
        demand_round_trip(powers, seed);
        total = hash_of_random_runs(seed, total);
    }
    free(powers);
    printf("%016" PRIx64 "\n", total);
    return 0;
}
