/* Parts of the verdicts on lines. Private. */
#ifndef LB_REPEATING_H
#define LB_REPEATING_H

#include "lines/moments.h"
#include "livebode/repeating.h"

/* Scratch memory of a period; `bins` are the lines and the detection lines. */
typedef struct {
    double *spectra; /* [3][bins][2]: output, denominator, reference */
    double *powers;  /* [mains.bins], of an output */
    double *ratio;   /* [lines][2] */
    double *line;    /* [lines] */
    double *model;   /* [distortion.bins][2] */
    double *mean;    /* [distortion.bins] */
    double *noise;   /* [distortion.bins] */
    double *beside;  /* [distortion.bins] */
} lb_scratch;

/* A verdict in the making. */
typedef struct {
    const lb_repeating_plan *plan;
    const lb_repeating_state *state;
    const lb_scratch *scratch;
    const double *pair;     /* [2][lines][2], means of numerator and denominator */
    lb_weight_sums weights; /* of the periods */
    double unbiased;        /* a scatter over this is the variance of one period */
    double of_mean;         /* variance of the mean over that */
} lb_verdict_facts;

typedef struct {
    double over_noise; /* power that repeats over that of the noise beside it */
    size_t known;      /* detection lines */
} lb_repeats;

#if !(defined(__GNUC__) || defined(__clang__))
#include <math.h>
#endif

static inline double lb_of_bits(uint64_t bits)
{
    const union {
        uint64_t bits;
        double value;
    } found = {bits};
    return found.value;
}

static inline double lb_not_a_number(void) { return lb_of_bits(0x7ff8000000000000u); }
static inline double lb_infinite(void) { return lb_of_bits(0x7ff0000000000000u); }

/* |x|, of zeros the positive one. */
static inline double lb_absolute(double x) { return x > 0.0 ? x : 0.0 - x; }

/* Exactly rounded; one instruction, without libm. */
static inline double lb_root(double x)
{
#if defined(__GNUC__) || defined(__clang__)
    return __builtin_sqrt(x);
#else
    return sqrt(x);
#endif
}

/* |x|², as pairs of re and im. */
static inline double lb_power(const double *x) { return x[0] * x[0] + x[1] * x[1]; }

/* The step of the output's sensor as it may move a line. */
static inline double lb_step_at(const lb_verdict_facts *f, size_t line)
{
    return f->state->step * f->plan->of_step[line];
}

/* Variance of uniform rounding to such steps, in a line's spectrum. */
static inline double lb_variance_of_steps(const lb_verdict_facts *f, size_t line)
{
    const double step = lb_step_at(f, line);
    return (double)f->plan->window * (step * step) / 12.0;
}

/* Sum in the order of numpy.sum over contiguous numbers. */
double lb_sum(const double *x, size_t count);

/* out = a·b, and out = a/b as NumPy divides: without overflow of |b|² (R. L. Smith, 1962). */
void lb_times(const double *a, const double *b, double *out);
void lb_divide(const double *a, const double *b, double *out);

/* Variance that distortion adds at the lines, [lines], and how significant it is; the ratio is in the scratch. */
lb_repeats lb_distortion_variance(const lb_verdict_facts *f, double *variance);

/* Lines that may contain hum, by the powers of the mean output in the scratch. */
void lb_mains_seen(const lb_repeating_plan *plan, const lb_scratch *scratch, uint8_t *seen);

/* A period without excitation: `powers` of the output at the bins of the mains; `gone` receives the lines whose hum is
 * withdrawn. Returns whether there is one. */
int lb_silence_take(const lb_repeating_plan *plan, const lb_repeating_state *state, const double *powers,
                    uint8_t *gone);

/* A period with excitation. */
void lb_silence_end(const lb_repeating_plan *plan, const lb_repeating_state *state);

int lb_stands_out(const lb_tones *tones, const double *powers, size_t tone);

#endif
