/* snapshot, restore: header, bins, delay lines, sums, and a checksum over all of it. Sums are stored bin by bin, so
 * that a snapshot does not depend on the width of the vectors. */
#include "state.h"

#define LB_SNAPSHOT_MAGIC 0x4642424Cu /* "LBBF" where the least byte comes first */
#define LB_SNAPSHOT_VERSION 1u

typedef struct {
    uint32_t magic, version, bits, variant;
    uint32_t window, channels, bin_count, hop;
    uint64_t count;
    double damping;
} header;

/* Bytes, not memcpy: the object's undefined symbols stay few and known. */
static void copy(unsigned char *to, const unsigned char *from, size_t bytes)
{
    for (size_t i = 0; i < bytes; ++i) {
        to[i] = from[i];
    }
}

/* CRC-32 (IEEE 802.3), four bits at a time. */
static uint32_t crc32(const unsigned char *data, size_t bytes)
{
    static const uint32_t of_nibble[16] = {
        0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u, 0x4DB26158u, 0x5005713Cu,
        0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu, 0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu,
    };
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 0; i < bytes; ++i) {
        crc ^= data[i];
        crc = (crc >> 4) ^ of_nibble[crc & 15u];
        crc = (crc >> 4) ^ of_nibble[crc & 15u];
    }
    return ~crc;
}

static header header_of(const LB_DFT *t)
{
    header h = {
        .magic = LB_SNAPSHOT_MAGIC,
        .version = LB_SNAPSHOT_VERSION,
        .bits = LB_BITS,
        .variant = (uint32_t)t->variant,
        .window = t->window,
        .channels = t->channels,
        .bin_count = t->bin_count,
        .hop = t->hop,
        .count = t->count,
        .damping = t->damping,
    };
    return h;
}

/* Samples of a channel's delay line. */
static size_t delayed(const LB_DFT *t) { return t->hop ? t->hop : t->window; }

/* A channel's sums, bin by bin; with a hop the ring follows, hop by hop. */
static size_t sums_of(const LB_DFT *t) { return (4u + (t->hop ? 2u * lb_places(t) : 0u)) * (size_t)t->inner_count; }

static real *sum_at(const LB_DFT *t, size_t channel, size_t number)
{
    const size_t K = t->inner_count;
    if (number < 4u * K) {
        return lb_sums(t, channel) + lb_sum_at(number / 4u) + number % 4u * LB_BLOCK;
    }
    number -= 4u * K;
    real *row = t->ring + (channel * lb_places(t) + number / (2u * K)) * t->row_length;
    return row + lb_cos_at(number % (2u * K) / 2u) + number % 2u * LB_BLOCK;
}

static size_t length_of(const LB_DFT *t)
{
    LB_ASSERT(lb_laid_out(t));
    return sizeof(header) + t->bin_count * sizeof(uint32_t) + t->channels * (delayed(t) + sums_of(t)) * sizeof(real) +
           sizeof(uint32_t);
}

lb_status LB(snapshot_size)(const LB_DFT *t, size_t *bytes)
{
    if (!t || !bytes) {
        return LB_ERROR_NULL;
    }
    *bytes = length_of(t);
    return LB_OK;
}

lb_status LB(snapshot)(LB_DFT *t, void *out, size_t bytes)
{
    if (!t || !out) {
        return LB_ERROR_NULL;
    }
    if (bytes != length_of(t)) {
        return LB_ERROR_SNAPSHOT_LENGTH;
    }
    LB_ASSERT(lb_sound(t));
    LB_ASSERT(lb_apart(out, bytes, t->table, (size_t)((unsigned char *)t->bins - (unsigned char *)t->table)));
    LB(catch_up)(t);
    const header h = header_of(t);
    unsigned char *at = (unsigned char *)out;
    copy(at, (const unsigned char *)&h, sizeof h);
    at += sizeof h;
    copy(at, (const unsigned char *)t->bins, t->bin_count * sizeof(uint32_t));
    at += t->bin_count * sizeof(uint32_t);
    for (size_t c = 0; c < t->channels; ++c) {
        real *line = t->line + c * t->line_length;
        for (size_t i = t->hop ? t->index % t->hop : t->window; i < t->hop; ++i) {
            line[i] = 0; /* of an earlier hop, or not */
        }
        copy(at, (const unsigned char *)line, delayed(t) * sizeof(real));
        at += delayed(t) * sizeof(real);
        for (size_t i = 0; i < sums_of(t); ++i, at += sizeof(real)) {
            copy(at, (const unsigned char *)sum_at(t, c, i), sizeof(real));
        }
    }
    LB_ASSERT((size_t)(at - (unsigned char *)out) == bytes - sizeof(uint32_t));
    const uint32_t crc = crc32((unsigned char *)out, bytes - sizeof(uint32_t));
    copy(at, (const unsigned char *)&crc, sizeof crc);
    return LB_OK;
}

static lb_status examine(const LB_DFT *t, const unsigned char *from, size_t bytes, header *h)
{
    uint32_t crc;
    if (bytes < sizeof(header) + sizeof crc) {
        return LB_ERROR_SNAPSHOT_LENGTH;
    }
    copy((unsigned char *)h, from, sizeof *h);
    if (h->magic != LB_SNAPSHOT_MAGIC || h->version != LB_SNAPSHOT_VERSION) {
        return LB_ERROR_SNAPSHOT_MAGIC;
    }
    copy((unsigned char *)&crc, from + bytes - sizeof crc, sizeof crc);
    if (crc != crc32(from, bytes - sizeof crc)) {
        return LB_ERROR_SNAPSHOT_CRC;
    }
    const header own = header_of(t);
    if (h->bits != own.bits || h->variant != own.variant || h->window != own.window || h->channels != own.channels ||
        h->bin_count != own.bin_count || h->hop != own.hop || h->damping != own.damping) {
        return LB_ERROR_SNAPSHOT_CONFIG;
    }
    if (bytes != length_of(t)) {
        return LB_ERROR_SNAPSHOT_LENGTH;
    }
    for (size_t i = 0; i < t->bin_count * sizeof(uint32_t); ++i) {
        if (from[sizeof(header) + i] != ((const unsigned char *)t->bins)[i]) {
            return LB_ERROR_SNAPSHOT_CONFIG;
        }
    }
    return LB_OK;
}

lb_status LB(restore)(LB_DFT *t, const void *snapshot, size_t bytes)
{
    if (!t || !snapshot) {
        return LB_ERROR_NULL;
    }
    header h;
    const unsigned char *at = (const unsigned char *)snapshot;
    const lb_status status = examine(t, at, bytes, &h);
    if (status != LB_OK) {
        return status;
    }
    LB_ASSERT(h.window == t->window && h.bin_count == t->bin_count && h.channels == t->channels);
    at += sizeof h + t->bin_count * sizeof(uint32_t);
    t->count = h.count;
    t->index = (uint32_t)(h.count % t->window);
    t->queued = 0;
    for (size_t c = 0; c < t->channels; ++c) {
        copy((unsigned char *)(t->line + c * t->line_length), at, delayed(t) * sizeof(real));
        at += delayed(t) * sizeof(real);
        for (size_t i = 0; i < sums_of(t); ++i, at += sizeof(real)) {
            copy((unsigned char *)sum_at(t, c, i), at, sizeof(real));
        }
    }
    if (t->hop) {
        LB(resume_hops)(t);
    }
    LB_ASSERT((size_t)(at - (const unsigned char *)snapshot) == bytes - sizeof(uint32_t));
    LB_ASSERT(lb_sound(t));
    return LB_OK;
}
