/* Columns of numbers and words as rows of a delimited table. */
#include "decimal.h"

#define DIGITS_MAX 20
/* Decimals without an exponent: 0.000001 … 9999999999. */
#define PLACES_LOW (-6)
#define PLACES_HIGH 10

static uint8_t *put_text(uint8_t *out, const char *text)
{
    while (*text) {
        *out++ = (uint8_t)*text++;
    }
    return out;
}

static uint8_t *put_bytes(uint8_t *out, const uint8_t *from, size_t count)
{
    memcpy(out, from, count);
    return out + count;
}

static uint8_t *put_zeros(uint8_t *out, int count)
{
    for (int i = 0; i < count; ++i) {
        *out++ = '0';
    }
    return out;
}

/* The digits of x, from the first to the end of `room`; the number of them. */
static int digits_of(uint64_t x, uint8_t *room)
{
    int count = 0;
    do {
        room[DIGITS_MAX - ++count] = (uint8_t)('0' + x % 10u);
        x /= 10u;
    } while (x);
    return count;
}

static uint8_t *put_integer(uint8_t *out, int64_t x)
{
    uint8_t room[DIGITS_MAX];
    const int count = digits_of(x < 0 ? 0 - (uint64_t)x : (uint64_t)x, room);
    if (x < 0) {
        *out++ = '-';
    }
    return put_bytes(out, room + DIGITS_MAX - count, (size_t)count);
}

static uint8_t *put_decimal(uint8_t *out, lb_decimal x)
{
    uint8_t room[DIGITS_MAX];
    const int count = digits_of(x.digits, room), first = count + x.exponent - 1; /* 10^first is the first digit's */
    const uint8_t *digits = room + DIGITS_MAX - count;
    if (first < PLACES_LOW || first >= PLACES_HIGH) {
        *out++ = digits[0];
        if (count > 1) {
            *out++ = '.';
            out = put_bytes(out, digits + 1, (size_t)count - 1);
        }
        *out++ = 'e';
        if (first > 0) {
            *out++ = '+';
        }
        return put_integer(out, first);
    }
    if (first < 0) {
        out = put_zeros(put_text(out, "0."), -first - 1);
        return put_bytes(out, digits, (size_t)count);
    }
    if (x.exponent >= 0) {
        return put_zeros(put_bytes(out, digits, (size_t)count), x.exponent);
    }
    out = put_bytes(out, digits, (size_t)first + 1);
    *out++ = '.';
    return put_bytes(out, digits + first + 1, (size_t)(-x.exponent));
}

static uint8_t *put_number(uint8_t *out, const uint64_t *powers, double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    if (x != x) {
        return put_text(out, "nan");
    }
    if (bits >> 63) {
        *out++ = '-';
        x = -x;
    }
    if (x == 0.0) {
        return put_text(out, "0");
    }
    return (bits << 1 >> 53) == 2047 ? put_text(out, "inf") : put_decimal(out, lb_shortest(powers, x));
}

/* Room that a row may need. */
static size_t row_bytes(const lb_table_column *columns, size_t width, size_t longest)
{
    size_t bytes = 0;
    for (size_t i = 0; i < width; ++i) {
        bytes += columns[i].words ? longest + 1u : LB_NUMBER_BYTES;
    }
    return bytes;
}

static size_t longest_of(const lb_table_words *words)
{
    size_t longest = 0;
    for (size_t i = 0; i < words->count; ++i) {
        const size_t length = (size_t)(words->ends[i + 1] - words->ends[i]);
        longest = length > longest ? length : longest;
    }
    return longest;
}

static int has_all(const lb_table_column *column, const lb_table_words *words, size_t rows)
{
    for (size_t i = 0; column->words && i < rows; ++i) {
        if (column->words[i] < 0 || (size_t)column->words[i] >= words->count) {
            return 0;
        }
    }
    return 1;
}

static uint8_t *put_cell(uint8_t *out, const uint64_t *powers, const lb_table_column *column,
                         const lb_table_words *words, size_t row)
{
    if (column->numbers) {
        return put_number(out, powers, column->numbers[row]);
    }
    if (column->integers) {
        return put_integer(out, column->integers[row]);
    }
    const int64_t *ends = words->ends + column->words[row];
    return put_bytes(out, words->text + ends[0], (size_t)(ends[1] - ends[0]));
}

lb_status lb_table_write(const uint64_t *powers, const lb_table_column *columns, size_t width,
                         const lb_table_words *words, size_t rows, uint8_t *out, size_t room, size_t *length)
{
    if (!powers || !columns || !words || !words->text || !words->ends || !out || !length) {
        return LB_ERROR_NULL;
    }
    for (size_t i = 0; i < width; ++i) {
        if (!columns[i].numbers && !columns[i].integers && !columns[i].words) {
            return LB_ERROR_NULL;
        }
        if (!has_all(columns + i, words, rows)) {
            return LB_ERROR_SIZE;
        }
    }
    const size_t a_row = row_bytes(columns, width, longest_of(words));
    if (width == 0 || room / a_row < rows) {
        return LB_ERROR_MEMORY;
    }
    uint8_t *at = out;
    for (size_t row = 0; row < rows; ++row) {
        for (size_t i = 0; i < width; ++i) {
            at = put_cell(at, powers, columns + i, words, row);
            *at++ = i + 1 < width ? ',' : '\n';
        }
    }
    *length = (size_t)(at - out);
    return LB_OK;
}
