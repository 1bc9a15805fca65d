/* size, init, reset: layout of an object in the caller's memory. */
#include "state.h"

/* Of vectors; without them of double and uint64_t. */
#if LB_BLOCK == 1
#define LB_ALIGN 8u
#else
#define LB_ALIGN 64u
#endif

static lb_status check(const lb_config *c)
{
    if (!c || !c->bins) {
        return LB_ERROR_NULL;
    }
    if (c->window < 1u || c->window > LB_WINDOW_MAX) {
        return LB_ERROR_WINDOW;
    }
    if (c->channels < 1u || c->channels > LB_CHANNELS_MAX) {
        return LB_ERROR_CHANNELS;
    }
    if (c->bin_count < 1u || c->bin_count > c->window) {
        return LB_ERROR_BINS;
    }
    for (uint32_t i = 0; i < c->bin_count; ++i) {
        if (c->bins[i] >= c->window) {
            return LB_ERROR_BINS;
        }
    }
    if ((unsigned)c->variant > LB_BLACKMAN) {
        return LB_ERROR_VARIANT;
    }
    if (c->variant == LB_DAMPED && !(c->damping > 0.0 && c->damping < 1.0)) {
        return LB_ERROR_DAMPING;
    }
    if (c->hop && (c->window % c->hop || c->variant != LB_MODULATED || c->table != LB_TABLE_ROWS)) {
        return LB_ERROR_HOP;
    }
    if ((unsigned)c->table > LB_TABLE_COMPACT || (c->table == LB_TABLE_COMPACT && c->window > LB_COMPACT_WINDOW_MAX)) {
        return LB_ERROR_TABLE;
    }
    return LB_OK;
}

/* Bytes so far, and whether they still fit. */
typedef struct {
    uint64_t bytes;
    unsigned char *base;
} cursor;

static void *take(cursor *at, uint64_t bytes)
{
    LB_ASSERT(at->bytes % LB_ALIGN == 0 && (uintptr_t)at->base % LB_ALIGN == 0);
    LB_ASSERT(bytes <= UINT64_MAX - LB_ALIGN - at->bytes);
    unsigned char *here = at->base ? at->base + at->bytes : at->base;
    at->bytes += (bytes + LB_ALIGN - 1u) / LB_ALIGN * LB_ALIGN;
    return here;
}

/* The only list of the memory's parts: measures with base = null, lays out with a base. No product overflows: window,
 * channels and bins are bounded (at most 2^24 · 2^24 · 2^7 bytes). */
static void lay_out(LB_DFT *t, cursor *at, const lb_config *c)
{
    const uint64_t bytes = sizeof(real), reach = 2u * lb_reach(c->variant);
    const uint64_t most = c->bin_count * (1u + reach);
    const uint64_t inner = most < c->window ? most : c->window;
    const uint64_t blocks = (inner + LB_BLOCK - 1u) / LB_BLOCK;
    const uint64_t samples = c->hop ? c->hop : c->window, places = c->hop ? c->window / c->hop : 0u;
    const uint64_t line = (samples * bytes + LB_ALIGN - 1u) / LB_ALIGN * LB_ALIGN / bytes;
    const uint64_t row = blocks * 2u * LB_BLOCK, rows = c->hop ? (c->hop + 1u) / 2u : (c->window + 1u) / 2u + 1u;
    const uint64_t columns = !c->hop ? 0u : LB_TILE ? LB_COLUMNS : c->channels;
    LB_ASSERT(inner >= c->bin_count && line >= samples);
    LB_ASSERT(!at->base || at->bytes); /* the object itself comes first */

    t->compact = c->table == LB_TABLE_COMPACT;
    t->row_length = (size_t)row;
    t->line_length = (size_t)line;
    t->blocks = (size_t)blocks;
    t->table = (real *)take(at, (t->compact ? c->window * UINT64_C(2) : rows * row) * bytes);
    t->rows = (real *)take(at, t->compact ? (LB_TILE + 1u) * row * bytes : 0u);
    t->sums = (real *)take(at, c->channels * blocks * 4u * LB_BLOCK * bytes);
    t->line = (real *)take(at, c->channels * line * bytes);
    t->delta = (real *)take(at, c->hop ? 0u : (uint64_t)c->channels * 3u * LB_TILE * bytes);
    t->queue = (real *)take(at, c->hop ? 0u : (uint64_t)c->channels * LB_TILE * bytes);
    t->turns = (real *)take(at, places * row * bytes);
    t->ahead = (real *)take(at, c->hop ? row * bytes : 0u);
    t->ring = (real *)take(at, c->channels * places * row * bytes);
    t->work = (real *)take(at, columns * row * bytes);
    t->spectrum = (real *)take(at, reach ? inner * 2u * bytes : 0u);
    t->bins = (uint32_t *)take(at, inner * sizeof(uint32_t));
    t->taps = (uint32_t *)take(at, reach ? (uint64_t)c->bin_count * 4u * sizeof(uint32_t) : 0u);
}

lb_status LB(size)(const lb_config *config, size_t *bytes)
{
    if (!bytes) {
        return LB_ERROR_NULL;
    }
    const lb_status status = check(config);
    if (status != LB_OK) {
        return status;
    }
    LB_DFT measured;
    cursor at = {0, 0};
    (void)take(&at, sizeof(LB_DFT) + LB_ALIGN - 1u);
    lay_out(&measured, &at, config);
    if (at.bytes > SIZE_MAX / 2u) {
        return LB_ERROR_SIZE;
    }
    *bytes = (size_t)at.bytes;
    return LB_OK;
}

/* The place of bin k among the inner bins, appended if new; place[k] is 1 + that place, 0 if unknown. */
static uint32_t place_of(LB_DFT *t, uint32_t *place, uint32_t k)
{
    LB_ASSERT(k < t->window && place[k] <= t->inner_count);
    if (!place[k]) {
        LB_ASSERT(t->inner_count < t->window);
        t->bins[t->inner_count++] = k;
        place[k] = t->inner_count;
    }
    return place[k] - 1u;
}

/* Bins of rows at a hop, found twice by a table of places without neighbours: weights for each bin are filled later. */
static lb_status fill_bins_of_hops(LB_DFT *t, const lb_config *c)
{
    uint32_t *found = (uint32_t *)(void *)t->table;
    const uint32_t K = c->bin_count, size = 2u * K;
    LB_ASSERT(lb_pairs(t) * t->row_length * sizeof(real) >= size * sizeof *found);
    for (uint32_t i = 0; i < size; ++i) {
        found[i] = UINT32_MAX;
    }
    for (uint32_t i = 0; i < K; ++i) {
        uint32_t at = c->bins[i] % size;
        while (found[at] != UINT32_MAX && found[at] != c->bins[i]) {
            at = at + 1u < size ? at + 1u : 0u;
        }
        if (found[at] == c->bins[i]) {
            return LB_ERROR_BINS;
        }
        t->bins[i] = found[at] = c->bins[i];
    }
    t->inner_count = K;
    return LB_OK;
}

static lb_status fill_bins(LB_DFT *t, const lb_config *c)
{
    if (t->hop) {
        return fill_bins_of_hops(t, c);
    }
    /* The table is filled later and larger than this: room to find duplicates without searching. */
    uint32_t *place = (uint32_t *)(void *)t->table;
    const uint32_t N = t->window, reach = lb_reach(c->variant);
    LB_ASSERT((t->compact ? 2u * (size_t)N : (t->half + 1u) * t->row_length) * sizeof(real) >= N * sizeof *place);
    for (uint32_t k = 0; k < N; ++k) {
        place[k] = 0;
    }
    for (uint32_t i = 0; i < c->bin_count; ++i) {
        if (place_of(t, place, c->bins[i]) != i) {
            return LB_ERROR_BINS;
        }
    }
    for (uint32_t i = 0; i < c->bin_count && reach; ++i) {
        const uint32_t k = c->bins[i];
        uint32_t *taps = t->taps + (size_t)i * 4u;
        taps[0] = place_of(t, place, (k + N - 1u) % N);
        taps[1] = place_of(t, place, (k + 1u) % N);
        taps[2] = reach < 2u ? i : place_of(t, place, (k + 2u * N - 2u) % N);
        taps[3] = reach < 2u ? i : place_of(t, place, (k + 2u) % N);
    }
    LB_ASSERT(t->inner_count >= c->bin_count && t->inner_count <= t->blocks * LB_BLOCK);
    t->blocks = (t->inner_count + LB_BLOCK - 1u) / LB_BLOCK;
    t->row_length = t->blocks * 2u * LB_BLOCK;
    return LB_OK;
}

lb_status LB(init)(void *memory, size_t bytes, const lb_config *config, LB_DFT **dft)
{
    if (!memory || !dft) {
        return LB_ERROR_NULL;
    }
    *dft = 0;
    size_t needed;
    lb_status status = LB(size)(config, &needed);
    if (status != LB_OK) {
        return status;
    }
    if (bytes < needed) {
        return LB_ERROR_MEMORY;
    }
    cursor at = {0, (unsigned char *)memory + (LB_ALIGN - (uintptr_t)memory % LB_ALIGN) % LB_ALIGN};
    LB_DFT *t = (LB_DFT *)take(&at, sizeof(LB_DFT));
    lay_out(t, &at, config);
    LB_ASSERT(at.base + at.bytes <= (unsigned char *)memory + bytes);
    status = LB(choose)(t, config->instruction_set);
    if (status != LB_OK) {
        return status;
    }
    t->variant = config->variant;
    t->window = config->window;
    t->channels = config->channels;
    t->bin_count = config->bin_count;
    t->hop = config->hop;
    t->inner_count = 0;
    t->half = (config->window + 1u) / 2u;
    t->damping = config->variant == LB_DAMPED ? config->damping : 1.0;
    double power = 1.0;
    for (uint32_t i = 0; i < t->window; ++i) {
        power *= t->damping;
    }
    t->radius = (real)t->damping;
    t->radius_window = (real)power;
    LB_ASSERT(power >= 0.0 && power <= 1.0);
    status = fill_bins(t, config);
    if (status != LB_OK) {
        return status;
    }
    (t->hop ? LB(fill_hops) : LB(fill_table))(t);
    *dft = t;
    return LB(reset)(t);
}

lb_status LB(reset)(LB_DFT *t)
{
    if (!t) {
        return LB_ERROR_NULL;
    }
    LB_ASSERT(lb_laid_out(t));
    t->count = 0;
    t->index = 0;
    t->queued = 0;
    for (size_t i = 0; i < t->channels * t->blocks * 4u * LB_BLOCK; ++i) {
        t->sums[i] = 0;
    }
    for (size_t i = 0; i < t->channels * t->line_length; ++i) {
        t->line[i] = 0;
    }
    if (t->hop) {
        LB(reset_hops)(t);
    }
    LB_ASSERT(lb_sound(t));
    return LB_OK;
}
