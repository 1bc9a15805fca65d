/* Verdicts on lines from whole periods of the signals: distortion, mains hum and sensor steps, which repeat with the
 * excitation, so that no scatter shows them.
 *
 * All arrays belong to the caller; arrays of spectra are pairs of re and im. The NumPy equivalent, with the same bits,
 * is tests/twins/repeating.py; where a result is not a number, its sign and payload are not specified. Sums
 * over lines have NumPy's order. */
#ifndef LIVEBODE_REPEATING_H
#define LIVEBODE_REPEATING_H

#include <stddef.h>
#include <stdint.h>

#include "livebode/lines.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reasons against a line. */
enum { LB_DISTORTED, LB_HUM, LB_STEPS };
#define LB_VERDICT_KINDS 3u

#define LB_MAINS 2u          /* mains frequencies */
#define LB_SILENT_PERIODS 9u /* without excitation, that are remembered */
#define LB_BESIDE 4u         /* detection lines on each side of a line */
#define LB_NEIGHBOURS_MAX 8u /* of a tone */

/* Bins at which a tone may be, and the neighbours with which each is compared. Places are those in lb_mains.bin. */
typedef struct {
    size_t count, beside;
    const int64_t *tones;      /* [count] */
    const int64_t *neighbours; /* [count][beside] */
    const uint8_t *usable;     /* [count][beside] */
    const double *known;       /* [count], number of usable neighbours, at least 1 */
    const uint8_t *enough;     /* [count], whether these are enough */
    const double *times;       /* [count], their mean that a tone exceeds */
} lb_tones;

typedef struct {
    size_t bins;
    const int64_t *bin;       /* [bins] of the DFT; none where no line is at a multiple of the mains */
    const uint8_t *multiples; /* [LB_MAINS][lines], which lines are at a multiple */
    lb_tones free[LB_MAINS];  /* other multiples */
    lb_tones excited;         /* all lines */
} lb_mains;

/* Detection lines at which distortion is seen. The response there is interpolated between two lines; the powers at the
 * lines are means over detection lines below and above. */
typedef struct {
    size_t bins;            /* 0 where distortion is not measured */
    const int64_t *left;    /* [bins], line below */
    const int64_t *right;   /* [bins], and above */
    const double *share;    /* [bins], of the way from one to the other */
    const int64_t *beside;  /* [2][lines][LB_BESIDE], detection lines below and above */
    const uint8_t *member;  /* [2][lines][LB_BESIDE], whether there is one */
    const double *position; /* [lines], share of the way from the lower ones to the upper ones */
} lb_distortion;

typedef struct {
    size_t window, lines, signals;
    size_t of_signal[3];   /* output, denominator, reference, among the signals */
    const int64_t *bin;    /* [lines + distortion.bins] of the DFT */
    const double *after;   /* [3][lines + distortion.bins][2], factors of the spectra; NULL without */
    int instrument;        /* the reference is the excitation itself */
    size_t judged_every;   /* periods */
    const double *of_step; /* [lines], what a step of the sensor is at a line */
    lb_mains mains;
    lb_distortion distortion;
} lb_repeating_plan;

/* Zeros before the first period, except for silent_power: NaN. */
typedef struct {
    double largest;          /* power of the reference at a line */
    double step;             /* of the output's sensor; 0 without */
    lb_line_moments moments; /* of one place, lines + distortion.bins lines; `moment` is not used */
    double *output;          /* [mains.bins][2], mean over these periods */
    double *silent_power;    /* [LB_SILENT_PERIODS][lines] of this silence, newest last */
    double *hum;             /* [lines], power of the hum in silence; 0 without */
    double *low;             /* [lines], consecutive periods without it */
    double *counts;          /* [2], periods of this silence, and whether there was excitation before it */
    uint8_t *told;           /* [LB_VERDICT_KINDS][lines], what was reported */
} lb_repeating_state;

/* What is rarely needed: the step of the output's samples in a period, and what the ratio of noise to itself at so many
 * detection lines, with so many degrees of freedom, exceeds by chance. */
typedef struct {
    void *context;
    double (*step_of)(void *context, size_t period);
    double (*by_chance)(void *context, size_t known, double dof);
} lb_repeating_rare;

typedef struct {
    size_t count;
    const double *spectra;    /* [signals][count][window/2 + 1][2], DFT of the signals */
    const uint8_t *usable;    /* [count], no sample is missing or left out */
    const uint8_t *moves;     /* [count], the machine moves */
    const double *distortion; /* [lines], verdict before them */
    const uint8_t *against;   /* [LB_VERDICT_KINDS][lines] */
    double *scratch;          /* lb_repeating_scratch numbers */
    lb_repeating_rare rare;
} lb_periods;

/* What happened in a period, as bits. */
enum {
    LB_PERIOD_FORGOTTEN = 1, /* the mean was restarted, before the period was added */
    LB_PERIOD_ADDED = 2,     /* to the mean */
    LB_PERIOD_JUDGED = 4,    /* there is a new verdict */
    LB_PERIOD_NEWS = 8       /* a line became invalid, or its hum has gone */
};
enum { LB_NEWS_NONE, LB_NEWS_INVALID, LB_NEWS_GONE };

/* The verdict before the periods, and after each: count + 1 rows. And for each period: what happened; where it was
 * judged also what explains the verdict. */
typedef struct {
    double *distortion; /* [count + 1][lines], of numerator/denominator; NaN where not known */
    uint8_t *against;   /* [count + 1][LB_VERDICT_KINDS][lines] */
    uint8_t *invalid;   /* [count + 1][lines], for any reason */
    uint8_t *happened;  /* [count] */
    uint8_t *news;      /* [count][LB_VERDICT_KINDS][lines], LB_NEWS_… */
    double *pair;       /* [count][2][lines][2], means of numerator and denominator */
    double *steps;      /* [count][lines], amplitude of the output in steps */
} lb_verdicts;

/* Numbers of scratch memory. */
size_t lb_repeating_scratch(const lb_repeating_plan *plan);

/* The verdicts after each of some consecutive periods. LB_ERROR_NULL for a missing pointer, LB_ERROR_SIZE for a plan
 * whose moments have another size. The bins and places of the plan are those of its arrays: they are not checked. */
lb_status lb_repeating_process(const lb_repeating_plan *plan, lb_repeating_state *state, const lb_periods *periods,
                               const lb_verdicts *out);

#ifdef __cplusplus
}
#endif

#endif
