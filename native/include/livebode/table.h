/* Rows of a delimited table as columns of numbers, and back; integers of a Parquet file.
 *
 * A number that is read is the double nearest to its text; a number that is written is the shortest text that gives the
 * same double. The Python definition is livebode.sources.rows for what is read, and
 * repr for the digits that are written; tests/twins/runs.py for integers in runs. */
#ifndef LIVEBODE_TABLE_H
#define LIVEBODE_TABLE_H

#include <stddef.h>
#include <stdint.h>

#include "livebode/sdft.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The table of powers: for each q the first 128 bits of 10^q, its highest bit set, as two numbers, the higher one
 * first. Truncated for q ≥ 0, and one more than truncated for q < 0. */
#define LB_POWER_FIRST (-342)
#define LB_POWER_LAST 324
#define LB_POWERS 667u

/* What a cell of a column contains. */
enum { LB_CELL_SKIPPED, LB_CELL_NUMBER, LB_CELL_MOMENT };

/* A moment that is missing. */
#define LB_NO_MOMENT INT64_MIN

typedef struct {
    const uint64_t *powers; /* [LB_POWERS][2] */
    size_t width;           /* cells of a row */
    const uint8_t *kinds;   /* [width], LB_CELL_… */
    const uint8_t *empty;   /* words that mean "no value", each followed by a byte 0 */
    size_t empty_bytes;
    size_t row_bytes_max; /* a longer row is not read */
    uint8_t delimiter, decimal;
    uint8_t quote;    /* 0: none */
    uint8_t has_zone; /* moments end with a time zone */
} lb_table_layout;

/* Read rows up to the first that is not plain: an unequal number of cells, a cell that is not a number, a moment or
 * empty, a quote within a number, or a number of more than 19 digits that is between two doubles. It may be valid.
 *
 * `out` has a row of `rows_max` doubles for each column that is not skipped. A moment is an int64_t in its place:
 * nanoseconds since 1970, LB_NO_MOMENT if missing. `rows` is the number of rows that `out` has, before and after;
 * `used` is where the next row begins. The last row may lack its end.
 *
 * LB_ERROR_NULL for a missing pointer, LB_ERROR_SIZE for a layout without columns. */
lb_status lb_table_read(const lb_table_layout *layout, const uint8_t *text, size_t length, size_t rows_max, double *out,
                        size_t *rows, size_t *used);

/* A column to be written; the others are NULL. */
typedef struct {
    const double *numbers;
    const int64_t *integers;
    const int64_t *words; /* numbers of words */
} lb_table_column;

/* Words one after the other: number i is at ends[i] … ends[i + 1]. */
typedef struct {
    const uint8_t *text;
    const int64_t *ends; /* [count + 1] */
    size_t count;
} lb_table_words;

/* Bytes of a number and the delimiter behind it, at most. */
#define LB_NUMBER_BYTES 32u

/* Write rows: cells separated by commas, each row with \n at its end. `length` is the number of bytes.
 *
 * LB_ERROR_NULL for a missing pointer, LB_ERROR_MEMORY where `room` bytes are too few, LB_ERROR_SIZE for a word that
 * does not exist. */
lb_status lb_table_write(const uint64_t *powers, const lb_table_column *columns, size_t width,
                         const lb_table_words *words, size_t rows, uint8_t *out, size_t room, size_t *length);

/* Bits of an integer in runs, at most. */
#define LB_RUN_WIDTH_MAX 32u

/* Decode `count` integers of `width` bits from Parquet's runs, in which a value is either repeated or packed with seven
 * others. Bytes behind the last run are not read.
 *
 * LB_ERROR_NULL for a missing pointer, LB_ERROR_SIZE for a larger width, or where the bytes have fewer integers. */
lb_status lb_runs_decode(const uint8_t *data, size_t length, unsigned width, size_t count, uint32_t *out);

#ifdef __cplusplus
}
#endif

#endif
