/* One number type's part of bits.c; included once per type, so no guard. */

/* The hash of a run by blocks; the same samples pushed one by one must end in the same snapshot. */
static uint64_t RUN(uint32_t window, uint32_t bin_count, lb_variant variant, lb_instruction_set set, lb_table table,
                    uint32_t own)
{
    uint32_t bins[64], state = window * 97u + bin_count;
    for (uint32_t i = 0; i < bin_count; ++i) {
        bins[i] = (i * (window / bin_count) + 1u) % window;
    }
    const lb_config config = {window, CHANNELS, bin_count, bins, variant, 0.99, set, table, own};
    size_t bytes, snapshot_bytes;
    DFT *blocks, *pushes;
    DEMAND(FN(size)(&config, &bytes) == LB_OK);
    void *memory[2] = {claim(bytes), claim(bytes)};
    DEMAND(FN(init)(memory[0], bytes, &config, &blocks) == LB_OK);
    DEMAND(FN(init)(memory[1], bytes, &config, &pushes) == LB_OK);

    uint64_t hash = 14695981039346656037u;
    static const size_t lengths[] = {1, 130, 7, 64, 260, 150}, hops[] = {1, 3, 1, 20, 7, 1};
    for (size_t block = 0; block < sizeof lengths / sizeof *lengths; ++block) {
        const size_t n = lengths[block], hop = own ? own * (1u + block % 2u) : hops[block];
        size_t rows;
        DEMAND(FN(rows)(blocks, n, hop, &rows) == LB_OK);
        const size_t along = block % 2 ? 1 : CHANNELS, across = block % 2 ? n : 1;
        REAL *x = (REAL *)claim(CHANNELS * n * sizeof(REAL)); /* [channel][sample] or the other way round */
        REAL *out = (REAL *)claim(CHANNELS * rows * bin_count * 2 * sizeof(REAL));
        for (size_t i = 0; i < CHANNELS * n; ++i) {
            x[i] = (REAL)noise(&state) / (REAL)131072;
        }
        DEMAND(FN(process)(blocks, x, (ptrdiff_t)across, (ptrdiff_t)along, n, hop,
                           block % 3 ? LB_PHASE_FIXED : LB_PHASE_WINDOW, out, rows) == LB_OK);
        for (size_t i = 0; i < n; ++i) {
            const REAL sample[CHANNELS] = {x[i * along], x[i * along + across]};
            DEMAND((i % 5 ? FN(queue) : FN(push))(pushes, sample) == LB_OK);
        }
        hash = hashed(hash, out, CHANNELS * rows * bin_count * 2 * sizeof(REAL));
        free(x);
        free(out);
    }

    DEMAND(FN(snapshot_size)(blocks, &snapshot_bytes) == LB_OK);
    unsigned char *one = (unsigned char *)claim(snapshot_bytes), *other = (unsigned char *)claim(snapshot_bytes);
    DEMAND(FN(snapshot)(blocks, one, snapshot_bytes) == LB_OK);
    DEMAND(FN(snapshot)(pushes, other, snapshot_bytes) == LB_OK);
    DEMAND(memcmp(one, other, snapshot_bytes) == 0);
    DEMAND(FN(reset)(pushes) == LB_OK);
    DEMAND(FN(restore)(pushes, one, snapshot_bytes) == LB_OK);
    DEMAND(FN(snapshot)(pushes, other, snapshot_bytes) == LB_OK);
    DEMAND(memcmp(one, other, snapshot_bytes) == 0);
    hash = hashed(hash, one, snapshot_bytes);
    free(one);
    free(other);
    free(memory[0]);
    free(memory[1]);
    return hash;
}
