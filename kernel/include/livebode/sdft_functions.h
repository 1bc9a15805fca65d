/* The functions of one number type; included by sdft.h once per type, so no guard. */
#define LB_JOIN_(suffix, name) lb_sdft##suffix##_##name
#define LB_JOIN(suffix, name) LB_JOIN_(suffix, name)
#define LB_FN(name) LB_JOIN(LB_SUFFIX, name)
#define LB_TYPE_(suffix) lb_sdft##suffix
#define LB_TYPE__(suffix) LB_TYPE_(suffix)
#define LB_TYPE LB_TYPE__(LB_SUFFIX)

typedef struct LB_TYPE LB_TYPE;

/* Bytes of memory that init needs; any alignment is permitted. */
lb_status LB_FN(size)(const lb_config *config, size_t *bytes);

/* Lays out `memory` and fills the tables; all samples before the first are zeros. */
lb_status LB_FN(init)(void *memory, size_t bytes, const lb_config *config, LB_TYPE **dft);

/* Back to the state after init. */
lb_status LB_FN(reset)(LB_TYPE *dft);

/* One sample of every channel, samples[channels]; all sums are up to date on return. Constant time except for
 * the swap every `window` samples. */
lb_status LB_FN(push)(LB_TYPE *dft, const LB_REAL *samples);

/* The same, but the sums may be updated later, at the latest when they are read: faster on machines with
 * vector units. The bits are those of push. */
lb_status LB_FN(queue)(LB_TYPE *dft, const LB_REAL *samples);

/* Number of rows for `length` further samples at `hop`: one after each sample whose number, counted from 1 at the
 * start, is a multiple of hop. None for hop = 0. */
lb_status LB_FN(rows)(const LB_TYPE *dft, size_t length, size_t hop, size_t *rows);

/* `length` samples of every channel, samples[c·channel_stride + i·sample_stride], strides in elements.
 * out[channels][rows][bins][2] receives the spectra, re and im; `rows` must be the result of rows().
 * hop = 0 gives no output (out may be null). The regions of samples and out do not overlap. */
lb_status LB_FN(process)(LB_TYPE *dft, const LB_REAL *samples, ptrdiff_t channel_stride, ptrdiff_t sample_stride,
                         size_t length, size_t hop, lb_phase phase, LB_REAL *out, size_t rows);

/* out[channels][bins][2]: the present spectra. */
lb_status LB_FN(read)(LB_TYPE *dft, lb_phase phase, LB_REAL *out);

/* Samples processed, per channel. */
lb_status LB_FN(count)(const LB_TYPE *dft, uint64_t *count);

/* The instruction set in use: never LB_BEST. */
lb_status LB_FN(instruction_set)(const LB_TYPE *dft, lb_instruction_set *set);

/* The whole state, exact: a restored run continues with the same bits. Values are in the machine's byte order. */
lb_status LB_FN(snapshot_size)(const LB_TYPE *dft, size_t *bytes);
lb_status LB_FN(snapshot)(LB_TYPE *dft, void *out, size_t bytes);
/* Into an object of the same configuration; on any error the object is unchanged. */
lb_status LB_FN(restore)(LB_TYPE *dft, const void *snapshot, size_t bytes);

#undef LB_JOIN_
#undef LB_JOIN
#undef LB_FN
#undef LB_TYPE_
#undef LB_TYPE__
#undef LB_TYPE
