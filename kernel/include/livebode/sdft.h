/* Modulated sliding DFT at chosen bins: the public interface.
 *
 *   size → init → push | queue | process → read        (every call returns a status)
 *
 * Memory belongs to the caller; nothing here allocates, prints or calls libm. The same functions exist for
 * double (lb_sdft64_…) and for float (lb_sdft32_…), from one source text. docs/reference/kernel.md explains the method.
 */
#ifndef LIVEBODE_SDFT_H
#define LIVEBODE_SDFT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A limit on everything: all products of these fit 64 bits. */
#define LB_WINDOW_MAX 16777216u
#define LB_CHANNELS_MAX 1024u
#define LB_COMPACT_WINDOW_MAX 65536u

typedef enum {
    LB_OK = 0,
    LB_ERROR_NULL,            /* a pointer is missing */
    LB_ERROR_WINDOW,          /* window is not in 1 … LB_WINDOW_MAX */
    LB_ERROR_BINS,            /* no bin, a bin ≥ window, or a bin given twice */
    LB_ERROR_CHANNELS,        /* channels is not in 1 … LB_CHANNELS_MAX */
    LB_ERROR_VARIANT,         /* unknown variant */
    LB_ERROR_DAMPING,         /* damping of the damped variant is not in (0, 1) */
    LB_ERROR_INSTRUCTION_SET, /* unknown, or this machine or build does not have it */
    LB_ERROR_SIZE,            /* the configuration needs more memory than size_t can represent */
    LB_ERROR_MEMORY,          /* the memory is smaller than size() reports */
    LB_ERROR_PHASE,           /* unknown phase */
    LB_ERROR_ROWS,            /* the output does not have exactly the rows of these samples */
    LB_ERROR_SNAPSHOT_LENGTH, /* a snapshot of another length: cut off, or of another configuration */
    LB_ERROR_SNAPSHOT_MAGIC,  /* not a snapshot, or one of another byte order or version */
    LB_ERROR_SNAPSHOT_CONFIG, /* a snapshot of another configuration */
    LB_ERROR_SNAPSHOT_CRC,    /* a damaged snapshot */
    LB_ERROR_TABLE,           /* unknown table, or a compact one with window > LB_COMPACT_WINDOW_MAX */
    LB_ERROR_HOP /* hop does not divide window, or is of another variant or table; or rows at another hop */
} lb_status;

/* All except the first are for comparison. Windows are exact taps over neighbouring bins (Jacobsen & Lyons
 * 2003): three for Hann and Hamming, five for Blackman. */
typedef enum {
    LB_MODULATED = 0, /* table-modulated, sums renewed every window: permanently bounded error */
    LB_PLAIN,         /* Nevaranta 2016, eq. (4): marginally stable, drifts */
    LB_DAMPED,        /* (4) with a pole inside the unit circle: no drift, but biased */
    LB_HANN,
    LB_HAMMING,
    LB_BLACKMAN
} lb_variant;

/* WINDOW: as the DFT of the last `window` samples, oldest first. FIXED: referred to a fixed grid of period
 * `window`; ratios between channels are the same, and no demodulation is needed. */
typedef enum { LB_PHASE_WINDOW = 0, LB_PHASE_FIXED } lb_phase;

typedef enum {
    LB_BEST = 0, /* the widest that this machine has */
    LB_BASELINE, /* what the compiler's default target has */
    LB_AVX2,
    LB_AVX512
} lb_instruction_set;

/* The twiddles in memory. ROWS: window/2 + 2 rows of bin_count each, read in place. COMPACT: window entries for all
 * bins, gathered for every sample: for machines with little memory. The bits are the same. */
typedef enum { LB_TABLE_ROWS = 0, LB_TABLE_COMPACT } lb_table;

typedef struct {
    uint32_t window;      /* samples, N */
    uint32_t channels;    /* sharing one index */
    uint32_t bin_count;   /* K */
    const uint32_t *bins; /* bin_count different bins, each < window; copied at init */
    lb_variant variant;
    double damping; /* pole radius of LB_DAMPED; ignored by the others */
    lb_instruction_set instruction_set;
    lb_table table;
    uint32_t hop; /* 0: spectra after any sample. Else, a divisor of window: spectra after every hop-th sample only, for
                     a third of the operations or less, LB_MODULATED with LB_TABLE_ROWS only; other bits than without */
} lb_config;

/* The instruction set that LB_BEST selects on this machine. */
lb_instruction_set lb_best_instruction_set(void);

#define LB_SUFFIX 64
#define LB_REAL double
#include "livebode/sdft_functions.h"
#undef LB_SUFFIX
#undef LB_REAL

#define LB_SUFFIX 32
#define LB_REAL float
#include "livebode/sdft_functions.h"
#undef LB_SUFFIX
#undef LB_REAL

#ifdef __cplusplus
}
#endif

#endif
