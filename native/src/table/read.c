/* Rows of a delimited table as columns of numbers. */
#include "decimal.h"

static int ends_line(uint8_t c) { return c == '\n' || c == '\r'; }

static int ends_cell(const lb_table_layout *t, uint8_t c) { return c == t->delimiter || ends_line(c); }

static int is_blank(const lb_table_layout *t, uint8_t c) { return (c == ' ' || c == '\t') && c != t->delimiter; }

/* The quote that ends the text from p on; NULL if the line ends before it. */
static const uint8_t *find_quote(const lb_table_layout *t, const uint8_t *p, const uint8_t *end)
{
    while (p < end && *p != t->quote && !ends_line(*p)) {
        ++p;
    }
    return p < end && *p == t->quote ? p : NULL;
}

static int is_quoted(const lb_table_layout *t, const uint8_t *p, const uint8_t *end)
{
    return t->quote && p < end && *p == t->quote;
}

/* The end of any cell; NULL if its quote has no end in this line. */
static const uint8_t *skip_cell(const lb_table_layout *t, const uint8_t *p, const uint8_t *end)
{
    if (is_quoted(t, p, end)) {
        do { /* two quotes are one in the text */
            p = find_quote(t, p + 1, end);
            if (!p) {
                return NULL;
            }
            ++p;
        } while (is_quoted(t, p, end));
    }
    while (p < end && !ends_cell(t, *p)) {
        ++p;
    }
    return p;
}

static int is_empty(const lb_table_layout *t, const uint8_t *p, size_t length)
{
    size_t begin = 0;
    for (size_t i = 0; i < t->empty_bytes; ++i) {
        if (t->empty[i] == 0) {
            if (i - begin == length && memcmp(p, t->empty + begin, length) == 0) {
                return 1;
            }
            begin = i + 1;
        }
    }
    return length == 0;
}

static double of_bits(uint64_t bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void store_moment(int64_t ns, double *out) { memcpy(out, &ns, sizeof ns); }

/* Without regard to case; `word` has small letters. */
static int is_word(const uint8_t *p, const uint8_t *end, const char *word)
{
    for (; p < end && *word && (*p | 0x20) == (uint8_t)*word; ++p) {
        ++word;
    }
    return p == end && !*word;
}

/* Whether the text is infinity or not a number. */
static int read_word(const uint8_t *p, const uint8_t *end, double *out)
{
    const uint64_t sign = (uint64_t)(p < end && *p == '-') << 63;
    p += p < end && (*p == '-' || *p == '+');
    if (is_word(p, end, "nan")) {
        *out = of_bits(0x7FF8000000000000u);
        return 1;
    }
    *out = of_bits(sign | 0x7FF0000000000000u);
    return is_word(p, end, "inf") || is_word(p, end, "infinity");
}

static const uint8_t *read_plain(const lb_table_layout *t, uint8_t kind, const uint8_t *p, const uint8_t *end,
                                 double *out)
{
    if (kind == LB_CELL_NUMBER) {
        return lb_number(t->powers, p, end, t->decimal == t->delimiter ? -1 : t->decimal, out);
    }
    int64_t ns = 0;
    p = lb_moment(p, end, t->has_zone, &ns);
    store_moment(ns, out);
    return p;
}

/* A value in quotes, a word, or nothing; NULL for anything else. */
static const uint8_t *read_rare(const lb_table_layout *t, uint8_t kind, const uint8_t *p, const uint8_t *end,
                                double *out)
{
    const uint8_t *after = skip_cell(t, p, end), *stop = after;
    if (!after) {
        return NULL;
    }
    if (is_quoted(t, p, end)) {
        stop = find_quote(t, ++p, end);
        if (stop + 1 != after) {
            return NULL;
        }
    }
    while (p < stop && is_blank(t, *p)) {
        ++p;
    }
    while (p < stop && is_blank(t, stop[-1])) {
        --stop;
    }
    if (is_empty(t, p, (size_t)(stop - p))) {
        *out = of_bits(0x7FF8000000000000u);
        if (kind == LB_CELL_MOMENT) {
            store_moment(LB_NO_MOMENT, out);
        }
        return after;
    }
    const int is_value = read_plain(t, kind, p, stop, out) == stop;
    return is_value || (kind == LB_CELL_NUMBER && read_word(p, stop, out)) ? after : NULL;
}

static const uint8_t *read_value(const lb_table_layout *t, uint8_t kind, const uint8_t *p, const uint8_t *end,
                                 double *out)
{
    const uint8_t *first = p;
    while (p < end && is_blank(t, *p)) {
        ++p;
    }
    p = read_plain(t, kind, p, end, out);
    while (p && p < end && is_blank(t, *p)) {
        ++p;
    }
    return p && (p == end || ends_cell(t, *p)) ? p : read_rare(t, kind, first, end, out);
}

/* The end of the row at p, whose values are at `out` and each so many further; NULL if it is not plain. */
static const uint8_t *read_row(const lb_table_layout *t, const uint8_t *p, const uint8_t *end, double *out,
                               size_t rows_max)
{
    for (size_t column = 0; column < t->width; ++column) {
        if (column) {
            if (p == end || *p != t->delimiter) {
                return NULL;
            }
            ++p;
        }
        if (t->kinds[column] == LB_CELL_SKIPPED) {
            p = skip_cell(t, p, end);
        } else {
            p = read_value(t, t->kinds[column], p, end, out);
            out += rows_max;
        }
        if (!p) {
            return NULL;
        }
    }
    return p == end || ends_line(*p) ? p : NULL;
}

lb_status lb_table_read(const lb_table_layout *t, const uint8_t *text, size_t length, size_t rows_max, double *out,
                        size_t *rows, size_t *used)
{
    if (!t || !t->powers || !t->kinds || !t->empty || !text || !out || !rows || !used) {
        return LB_ERROR_NULL;
    }
    if (t->width == 0) {
        return LB_ERROR_SIZE;
    }
    const uint8_t *p = text, *const end = text + length;
    size_t row = *rows;
    while (p < end && row < rows_max) {
        if (ends_line(*p)) {
            ++p;
            continue;
        }
        const uint8_t *after = read_row(t, p, end, out + row, rows_max);
        if (!after || (size_t)(after - p) > t->row_bytes_max) {
            break;
        }
        p = after;
        ++row;
    }
    *rows = row;
    *used = (size_t)(p - text);
    return LB_OK;
}
