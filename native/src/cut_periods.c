/* Periods of a signal. Compiled once for each instruction set; with the baseline also the choice. */
#include "livebode/periods.h"

#include "elementary.h"
#include "lb_assert.h"
#include "lines/choice.h"
#include "lines/lanes.h"

#ifndef LB_PERIODS_NAME
#define LB_PERIODS_NAME lb_periods_baseline
#define LB_WITH_CHOICE
#endif

typedef struct {
    void (*typical)(const lb_periods *of, double *out);
    void (*levels)(const lb_periods *of, const double *less, double *work, double *out);
    void (*straighten)(const lb_periods *of, const lb_periods_drift *drift, double *out);
    void (*reach)(const lb_periods *of, const double *typical, double *far, double *size);
} lb_periods_kernels;

extern const lb_periods_kernels lb_periods_baseline, lb_periods_avx2, lb_periods_avx512;

#define FEW_MAX 32u    /* numbers that are sorted at once */
#define ROUNDS_MAX 64u /* that halve the numbers, except of those that were made to prevent it */
#define ABREAST 2u

/* Of numbers. */
#if !defined(LB_SCALAR) && defined(__AVX512F__)
LB_INLINE lb_lanes more(lb_lanes a, lb_lanes b) { return (lb_lanes)_mm512_max_pd((__m512d)a, (__m512d)b); }
LB_INLINE lb_lanes fewer(lb_lanes a, lb_lanes b) { return (lb_lanes)_mm512_min_pd((__m512d)a, (__m512d)b); }
#elif !defined(LB_SCALAR) && defined(__AVX2__)
LB_INLINE lb_lanes more(lb_lanes a, lb_lanes b) { return (lb_lanes)_mm256_max_pd((__m256d)a, (__m256d)b); }
LB_INLINE lb_lanes fewer(lb_lanes a, lb_lanes b) { return (lb_lanes)_mm256_min_pd((__m256d)a, (__m256d)b); }
#else
LB_INLINE lb_lanes more(lb_lanes a, lb_lanes b) { return lb_select(lb_above(a, b), a, b); }
LB_INLINE lb_lanes fewer(lb_lanes a, lb_lanes b) { return lb_select(lb_above(a, b), b, a); }
#endif

typedef struct {
    lb_lanes at[ABREAST];
} row;

/* Sorts each lane by comparisons whose places do not depend on the numbers (Knuth 5.2.2, algorithm M). */
LB_INLINE void sort(row *v, size_t count)
{
    size_t top = 1u;
    while (2u * top < count) {
        top *= 2u;
    }
    for (size_t p = top; p > 0; p /= 2u) {
        for (size_t q = top, r = 0, d = p;; d = q - p, q /= 2u, r = p) {
            for (size_t i = 0; i + d < count; ++i) {
                for (size_t k = 0; (i & p) == r && k < ABREAST; ++k) {
                    const lb_lanes a = v[i].at[k], b = v[i + d].at[k];
                    v[i].at[k] = fewer(a, b);
                    v[i + d].at[k] = more(a, b);
                }
            }
            if (q == p) {
                break;
            }
        }
    }
}

/* The middle of two sorted halves: of one ascending and the other descending, the lesser ones are the lower half. */
LB_INLINE lb_lanes middle(const row *v, size_t half, size_t k, int is_odd)
{
    lb_lanes lower = fewer(v[0].at[k], v[2u * half - 1u].at[k]), upper = more(v[0].at[k], v[2u * half - 1u].at[k]);
    for (size_t i = 1u; i < half; ++i) {
        const lb_lanes a = v[i].at[k], b = v[2u * half - 1u - i].at[k];
        lower = more(lower, fewer(a, b));
        upper = fewer(upper, more(a, b));
    }
    return lb_select(is_odd ? ~lb_no_lane() : lb_no_lane(), lower, (lower + upper) / 2.0);
}

static void typical(const lb_periods *of, double *out)
{
    const size_t half = (of->periods + 1u) / 2u;
    LB_ASSERT(of->periods > 0 && of->periods <= LB_PERIODS_MAX);
    for (size_t j = 0; j < of->window; j += ABREAST * LB_LANES) {
        row v[LB_PERIODS_MAX];
        lb_mask known[ABREAST];
        for (size_t k = 0; k < ABREAST; ++k) {
            const size_t first = j + k * LB_LANES, count = first < of->window ? of->window - first : 0;
            known[k] = ~lb_no_lane();
            v[2u * half - 1u].at[k] = lb_all(lb_infinity()); /* of an odd number */
            for (size_t i = 0; i < of->periods; ++i) {
                v[i].at[k] = count ? lb_load(of->x + i * of->window + first, count) : lb_all(0.0);
                known[k] &= lb_are_numbers(v[i].at[k]);
            }
        }
        sort(v, half);
        sort(v + half, half);
        for (size_t k = 0; k < ABREAST && j + k * LB_LANES < of->window; ++k) {
            const lb_lanes found = middle(v, half, k, of->periods % 2u != 0);
            lb_store(out + j + k * LB_LANES, lb_select(known[k], found, lb_all(lb_not_a_number())),
                     of->window - j - k * LB_LANES);
        }
    }
}

LB_INLINE double sum_of(const lb_lanes *parts)
{
    const lb_lanes both = parts[0] + parts[1];
    double sum = 0.0;
    for (size_t i = 0; i < LB_LANES; ++i) {
        sum += lb_lane(&both, i);
    }
    return sum;
}

LB_INLINE lb_lanes sizes_of(lb_lanes x) { return lb_select(lb_above(x, lb_all(0.0)), x, 0.0 - x); }

/* Numbers less others, or as they are; and their sum. */
static double difference(const double *x, const double *less, size_t count, double *out)
{
    lb_lanes sum[2] = {lb_all(0.0), lb_all(0.0)};
    for (size_t i = 0, k = 0; i < count; i += LB_LANES, k ^= 1u) {
        const lb_lanes value = lb_load(x + i, count - i) - (less ? lb_load(less + i, count - i) : lb_all(0.0));
        lb_store(out + i, value, count - i);
        sum[k] += value;
    }
    return sum_of(sum);
}

/* The sum of the distances from a number. */
static double distances(const double *v, size_t count, double from)
{
    lb_lanes sum[2] = {lb_all(0.0), lb_all(0.0)};
    size_t i = 0;
    for (size_t k = 0; count - i >= LB_LANES; i += LB_LANES, k ^= 1u) {
        sum[k] += sizes_of(lb_load(v + i, LB_LANES) - from);
    }
    for (; i < count; ++i) {
        sum[0] += sizes_of(lb_all(v[i] - from)) / (double)LB_LANES;
    }
    return sum_of(sum);
}

/* Copies those from low to high, with room for a vector more, and counts those below. */
static size_t copy_between(const double *v, size_t count, double low, double high, double *out, size_t *below)
{
    size_t inside = 0, i = 0;
    *below = 0;
#if !defined(LB_SCALAR) && defined(__AVX512F__)
    for (; count - i >= LB_LANES; i += LB_LANES) {
        const __m512d x = _mm512_loadu_pd(v + i);
        const __mmask8 is_below = _mm512_cmp_pd_mask(x, _mm512_set1_pd(low), _CMP_LT_OQ);
        const __mmask8 is_inside = _mm512_mask_cmp_pd_mask((__mmask8)~is_below, x, _mm512_set1_pd(high), _CMP_LE_OQ);
        _mm512_storeu_pd(out + inside, _mm512_maskz_compress_pd(is_inside, x));
        *below += (size_t)__builtin_popcount(is_below);
        inside += (size_t)__builtin_popcount(is_inside);
    }
#endif
    for (; i < count; ++i) { /* without a branch to predict */
        out[inside] = v[i];
        *below += (size_t)(v[i] < low);
        inside += (size_t)(v[i] >= low) & (size_t)(v[i] <= high);
    }
    return inside;
}

/* Shell's sort: of few numbers nearly one by one. */
static void sort_all(double *v, size_t count)
{
    size_t gap = 1u;
    while (gap < count / 9u) {
        gap = 3u * gap + 1u;
    }
    for (; gap > 0; gap /= 3u) {
        for (size_t i = gap; i < count; ++i) {
            const double value = v[i];
            size_t at = i;
            for (; at >= gap && v[at - gap] > value; at -= gap) {
                v[at] = v[at - gap];
            }
            v[at] = value;
        }
    }
}

static double middle_of_three(double a, double b, double c)
{
    const double low = a < b ? a : b, high = a < b ? b : a;
    return c < low ? low : c < high ? c : high;
}

/* Keeps the numbers on that side of one of them where those of rank k - 1 and k are, or these two; often half. */
static size_t keep_side(double *v, size_t count, size_t *k)
{
    const double pivot = middle_of_three(v[count / 4u], v[count / 2u], v[count - 1u - count / 4u]);
    size_t below = 0, above = 0, kept = 0;
    for (size_t i = 0; i < count; ++i) {
        below += (size_t)(v[i] < pivot);
        above += (size_t)(v[i] > pivot);
    }
    if (*k >= below && *k <= count - above) {
        double under = -lb_infinity(), over = lb_infinity();
        for (size_t i = 0; i < count; ++i) {
            under = v[i] < pivot && v[i] > under ? v[i] : under;
            over = v[i] > pivot && v[i] < over ? v[i] : over;
        }
        v[0] = *k > below ? pivot : under;
        v[1] = *k < count - above ? pivot : over;
        *k = 1u;
        return 2u;
    }
    const double sign = *k < below ? 1.0 : -1.0;
    for (size_t i = 0; i < count; ++i) {
        const double value = v[i];
        v[kept] = value;
        kept += (size_t)(sign * value < sign * pivot);
    }
    *k -= *k < below ? 0 : count - above;
    return kept;
}

/* The numbers from low to high, and how many are below; none if those of rank k - 1 and k are not among them. */
static size_t keep_ranks(const double *v, size_t count, size_t k, double low, double high, double *out, size_t *below)
{
    const size_t inside = copy_between(v, count, low, high, out, below);
    return *below < k && k < *below + inside ? inside : 0;
}

/* The median of numbers with this sum; work is as long, and a vector more.
 *
 * Only those near their mean, and of these only those near the place of the middle among them, are sorted. */
static double median(double *v, size_t count, double sum, double *work)
{
    const double mean = sum / (double)count, width = distances(v, count, mean) / (double)count / 4.0;
    const size_t k = count / 2u;
    size_t below = 0, inside = keep_ranks(v, count, k, mean - width, mean + width, work, &below);
    for (size_t i = 0; sum - sum != 0.0 && i < count; ++i) {
        if (v[i] != v[i]) {
            return lb_not_a_number();
        }
    }
    if (inside > FEW_MAX) {
        const double place = (double)(k - below) / (double)inside, near = 2.0 / sqrt((double)inside);
        const double low = mean + width * (2.0 * (place - near) - 1.0), high = low + 4.0 * width * near;
        inside = keep_ranks(v, count, k, low, high, work, &below);
    }
    if (!inside) {
        below = 0;
        inside = count;
        work = v;
    }
    size_t rank = k - below;
    for (size_t round = 0; inside > FEW_MAX && round < ROUNDS_MAX; ++round) {
        inside = keep_side(work, inside, &rank);
    }
    sort_all(work, inside);
    return count % 2u ? work[rank] : (work[rank - 1u] + work[rank]) / 2.0;
}

static void levels(const lb_periods *of, const double *less, double *work, double *out)
{
    LB_ASSERT(of->window > 0);
    for (size_t i = 0; i < of->periods; ++i) {
        const double sum = difference(of->x + i * of->window, less, of->window, work);
        out[i] = median(work, of->window, sum, work + of->window);
    }
}

static void straighten(const lb_periods *of, const lb_periods_drift *drift, double *out)
{
    LB_ASSERT(drift->middle <= of->window);
    for (size_t i = 0; i < of->periods; ++i) {
        const double *const x = of->x + i * of->window, level = drift->level[i];
        const double slopes[2] = {drift->before[i], drift->behind[i]};
        const size_t ends[3] = {0, drift->middle, of->window};
        for (size_t part = 0; part < 2u; ++part) {
            for (size_t j = ends[part]; j < ends[part + 1u]; ++j) {
                out[i * of->window + j] = x[j] - (slopes[part] * drift->position[j] + level) - drift->all;
            }
        }
    }
}

static void reach(const lb_periods *of, const double *typical_one, double *far, double *size)
{
    for (size_t i = 0; i < of->periods; ++i) {
        lb_lanes most = lb_all(0.0), largest = most;
        lb_mask known = ~lb_no_lane(), known_size = known;
        for (size_t j = 0; j < of->window; j += LB_LANES) {
            const size_t left = of->window - j;
            const lb_lanes x = lb_load(of->x + i * of->window + j, left);
            const lb_lanes away = x - lb_load(typical_one + j, left);
            known &= lb_are_numbers(away);
            known_size &= lb_are_numbers(x);
            most = more(most, sizes_of(away));
            largest = more(largest, sizes_of(x));
        }
        far[i] = lb_largest_lane(lb_select(known, most, lb_all(lb_not_a_number())));
        size[i] = lb_largest_lane(lb_select(known_size, largest, lb_all(lb_not_a_number())));
    }
}

const lb_periods_kernels LB_PERIODS_NAME = {typical, levels, straighten, reach};

#ifdef LB_WITH_CHOICE

static const lb_periods_kernels *const kernels[] = LB_BY_SET(&lb_periods);

/* The functions for an instruction set, or what is wrong with the periods. */
static lb_status choose(const lb_periods *of, const lb_periods_kernels **chosen)
{
    if (!of || !of->x) {
        return LB_ERROR_NULL;
    }
    *chosen = kernels[lb_choice(of->set)];
    return !of->periods || !of->window ? LB_ERROR_SIZE : *chosen ? LB_OK : LB_ERROR_INSTRUCTION_SET;
}

lb_status lb_periods_typical(const lb_periods *of, double *out)
{
    const lb_periods_kernels *kernel = NULL;
    const lb_status status = choose(of, &kernel);
    if (status != LB_OK || !out) {
        return status != LB_OK ? status : LB_ERROR_NULL;
    }
    if (of->periods > LB_PERIODS_MAX) {
        return LB_ERROR_SIZE;
    }
    kernel->typical(of, out);
    return LB_OK;
}

lb_status lb_periods_levels(const lb_periods *of, const double *less, double *work, double *out)
{
    const lb_periods_kernels *kernel = NULL;
    const lb_status status = choose(of, &kernel);
    if (status != LB_OK || !work || !out) {
        return status != LB_OK ? status : LB_ERROR_NULL;
    }
    kernel->levels(of, less, work, out);
    return LB_OK;
}

lb_status lb_periods_straighten(const lb_periods *of, const lb_periods_drift *drift, double *out)
{
    const lb_periods_kernels *kernel = NULL;
    const lb_status status = choose(of, &kernel);
    if (status != LB_OK || !drift || !drift->position || !drift->level || !drift->before || !drift->behind || !out) {
        return status != LB_OK ? status : LB_ERROR_NULL;
    }
    if (drift->middle > of->window) {
        return LB_ERROR_SIZE;
    }
    kernel->straighten(of, drift, out);
    return LB_OK;
}

lb_status lb_periods_reach(const lb_periods *of, const double *typical_one, double *far, double *size)
{
    const lb_periods_kernels *kernel = NULL;
    const lb_status status = choose(of, &kernel);
    if (status != LB_OK || !typical_one || !far || !size) {
        return status != LB_OK ? status : LB_ERROR_NULL;
    }
    kernel->reach(of, typical_one, far, size);
    return LB_OK;
}

#endif
