/* Frequency responses with their scatter: one pass over the windows, whose lines stay in registers from the spectra to
 * the results. Compiled once for each instruction set. */
#include "rows.h"

#include "changes.h"
#include "results.h"

#ifndef LB_LINES_NAME
#define LB_LINES_NAME lb_lines_baseline
#endif

/* A window counts as excited at a line down to this share of the largest power seen: above the rounding of the DFT,
 * below any intended excitation. */
static const double excited_share = 1e-12;

LB_INLINE const double *row_of(const lb_line_windows *in, const double *spectra, size_t row)
{
    return spectra + 2u * row * in->stride;
}

LB_INLINE double power_at(const double *spectrum) { return spectrum[0] * spectrum[0] + spectrum[1] * spectrum[1]; }

LB_INLINE lb_lanes powers_at(const double *spectrum, size_t count)
{
    lb_lanes re, im;
    lb_load_pairs(spectrum, count, &re, &im);
    return re * re + im * im;
}

/* The largest power at a line, NaN where one is. Zeros beyond the last line change nothing. */
LB_INLINE double level_of(const double *reference, size_t lines)
{
    lb_lanes most = lb_all(0.0);
    size_t first = 0;
    for (; lines - first >= LB_LANES; first += LB_LANES) {
        most = lb_larger(most, powers_at(reference + 2u * first, LB_LANES));
    }
    most = lb_larger(most, powers_at(reference + 2u * first, lines - first));
    return lb_largest_lane(most);
}

/* The largest power of the reference so far, and whether the window has excitation at a line. */
LB_INLINE int is_excited(const lb_line_job *j, size_t row, const double *reference, double *largest)
{
    const double level = level_of(reference, j->m->lines);
    *largest = lb_maximum(*largest, j->in->whole[row] ? level : 0.0);
    const double above = excited_share * *largest;
    int found = level > above && level > 0.0;
    for (size_t i = 0; level != level && i < j->m->lines; ++i) {
        const double power = power_at(reference + 2u * i);
        found |= power > above && power > 0.0;
    }
    return found;
}

LB_INLINE void multiply_conjugate(lb_lanes a, lb_lanes b, lb_lanes c, lb_lanes d, lb_lanes *product)
{
    product[0] = a * c + b * d;
    product[1] = b * c - a * d;
}

LB_INLINE lb_window read_window(const lb_line_job *j, const lb_row_facts *f, size_t first, size_t count)
{
    lb_window now;
    lb_lanes yr, yi, ur, ui, wr, wi;
    lb_load_pairs(f->output + 2u * first, count, &yr, &yi);
    lb_load_pairs(f->denominator + 2u * first, count, &ur, &ui);
    lb_load_pairs(f->reference + 2u * first, count, &wr, &wi);
    multiply_conjugate(yr, yi, wr, wi, now.of + NUM_RE);
    multiply_conjugate(ur, ui, wr, wi, now.of + DEN_RE);
    now.of[REF_RE] = wr;
    now.of[REF_IM] = wi;
    now.of[REF_POWER] = wr * wr + wi * wi;
    now.of[OUT_POWER] = yr * yr + yi * yi;
    now.of[NOISE_POWER] = j->in->noise ? lb_load(j->in->noise + f->row * j->m->lines + first, count) : lb_all(0.0);
    now.of[DEN_POWER] = ur * ur + ui * ui;
    return now;
}

/* Scatter of numerator − ratio·denominator over the periods. */
LB_INLINE lb_lanes unexplained(const lb_some_moments *m, const lb_quotient *ratio)
{
    const lb_lanes re = ratio->re, im = ratio->im;
    const lb_lanes shared = re * m->scatter[SHARED_RE] + im * m->scatter[SHARED_IM];
    const lb_lanes total = m->scatter[NUM_SCATTER] - 2.0 * shared + (re * re + im * im) * m->scatter[DEN_SCATTER];
    return lb_at_least(0.0, total); /* rounding can make it negative */
}

/* With detection lines: the noise from the scatter is replaced by theirs where that is wanted. */
LB_INLINE lb_lanes selected_noise(const lb_line_job *j, const lb_row_facts *f, lb_lanes remembered, lb_lanes now,
                                  lb_lanes noise)
{
    const lb_lanes beside = j->s->averages ? remembered : now;
    if (f->moving) {
        return beside;
    }
    if (j->s->noise == LB_NOISE_LARGER) {
        return lb_known_larger(noise, lb_select(lb_are_finite(noise), remembered, beside));
    }
    return noise;
}

/* Adds errors that repeat to the variance; the degrees of freedom are matched in two moments (Satterthwaite 1946). */
LB_INLINE void widen(const lb_line_job *j, lb_row_facts *f, size_t first, size_t count, lb_estimates *e)
{
    const double *known = j->in->distortion + (size_t)j->in->verdict[f->row] * j->m->lines + first;
    const double noise_share = 1.0 / f->dof, added_share = 1.0 / j->s->dof_repeating;
    const lb_lanes distortion = lb_load(known, count), noise = e->variance;
    const lb_lanes added = lb_select(lb_are_finite(distortion), distortion * distortion, lb_all(0.0));
    const lb_lanes together = noise + added;
    const lb_lanes dof = together * together / (noise * noise * noise_share + added * added * added_share);
    e->distortion = distortion;
    e->variance = together;
    f->least_dof = lb_select(lb_are_finite(dof) & lb_above(f->least_dof, dof), dof, f->least_dof);
    f->widened |= lb_above(added, lb_all(0.0));
}

LB_INLINE lb_estimates estimated(const lb_line_job *j, lb_row_facts *f, size_t first, size_t count,
                                 const lb_some_moments *m, const lb_quotient *ratio, const lb_some_changes *c,
                                 const lb_window *now)
{
    lb_estimates e;
    const lb_quotient value = j->s->averages ? *ratio : lb_divided(now->of);
    lb_lanes noise = lb_divided_scatter(f, unexplained(m, ratio), c, &e.variation);
    e.re = value.re;
    e.im = value.im;
    e.inverse = value.inverse;
    if (j->s->noise != LB_NOISE_SCATTER) {
        noise = selected_noise(j, f, m->mean[NOISE_POWER], now->of[NOISE_POWER], noise);
    }
    const lb_lanes power = now->of[REF_POWER];
    e.variance = noise * f->of->of_mean * e.inverse;
    e.variation = e.variation * e.inverse;
    if (f->moving) { /* it is the motion */
        e.variation = lb_all(LB_NOT_A_NUMBER);
    }
    e.variance += lb_select(lb_are_numbers(e.variation), e.variation, lb_all(0.0));
    e.distortion = lb_all(LB_NOT_A_NUMBER);
    e.valid = lb_no_lane();
    if (f->seen) {
        const lb_mask excited = lb_above(power, lb_all(f->excited_above)) & lb_above(power, lb_all(0.0));
        e.valid = excited & lb_are_finite(e.re) & lb_are_finite(e.im);
    }
    if (j->in->distortion) {
        widen(j, f, first, count, &e);
    }
    return e;
}

LB_INLINE void process_lines(const lb_line_job *j, lb_row_facts *f, size_t first, size_t count)
{
    const size_t at = lb_place(j->m, f->place, first);
    const lb_window now = read_window(j, f, first, count);
    lb_some_moments m = lb_load_moments(j->m, at, count);
    lb_some_changes c = lb_load_changes(j->m, at, count);
    lb_deviation apart = {{lb_all(0.0), lb_all(0.0), lb_all(0.0), lb_all(0.0)}};
    if (f->usable && j->s->averages) {
        apart = lb_add_window(&m, j->weights->forgetting, f->of->share, &now);
    }
    const lb_quotient ratio = lb_divided(m.mean);
    if (f->usable && j->s->averages) {
        lb_add_change(j, f, &apart, &ratio, &c);
    }
    const lb_estimates e = estimated(j, f, first, count, &m, &ratio, &c, &now);
    lb_write_results(j, f, first, count, &m, &now, &e);
    if (f->usable && !j->s->averages) {
        apart = lb_add_window(&m, j->weights->forgetting, f->of->share, &now);
        lb_add_change(j, f, &apart, &ratio, &c);
    }
    if (f->usable) {
        lb_store_moments(j->m, at, count, &m);
        lb_store_changes(j->m, at, count, &c);
    }
}

LB_INLINE double dof_of(const lb_row_facts *f)
{
    double least = LB_INFINITE;
    int is_widened = 0;
    for (size_t i = 0; i < LB_LANES; ++i) {
        const lb_lanes widened = lb_select(f->widened, lb_all(1.0), lb_all(0.0));
        least = lb_lane(&f->least_dof, i) < least ? lb_lane(&f->least_dof, i) : least;
        is_widened |= lb_lane(&widened, i) > 0.0;
    }
    return is_widened ? lb_fmin(f->dof, least) : f->dof;
}

/* Means of time and schedule, and the oldest sample. */
LB_INLINE void average_moment(const lb_line_job *j, const lb_row_facts *f)
{
    const size_t rows = j->in->rows, places = j->m->places;
    double *mean = j->m->moment + f->place;
    const double *now = j->in->moment + f->row;
    if (!f->usable) {
        return;
    }
    mean[2u * places] = f->of->share < 1.0 ? mean[2u * places] : now[2u * rows];
    for (size_t i = 0; i < 2u; ++i) {
        mean[i * places] += (now[i * rows] - mean[i * places]) * f->of->share;
    }
}

LB_INLINE void write_moment(const lb_line_job *j, const lb_row_facts *f, int has_begun)
{
    for (size_t i = 0; i < 3u; ++i) {
        const size_t to = i * j->in->rows + f->row;
        j->out->moment[to] = has_begun ? j->m->moment[i * j->m->places + f->place] : j->in->moment[to];
    }
}

LB_INLINE void process_row(const lb_line_job *j, size_t row, size_t place, double *largest, lb_weight_facts *known)
{
    const lb_line_windows *in = j->in;
    int64_t *counted = j->m->count + place;
    lb_row_facts f = {.row = row, .place = place, .of = known};
    f.output = row_of(in, in->output, row);
    f.denominator = row_of(in, in->denominator, row);
    f.reference = row_of(in, in->reference, row);
    f.usable = is_excited(j, row, f.reference, largest) && in->clean[row] && !(in->aside && in->aside[row]);
    f.seen = j->s->averages ? in->whole[row] : in->clean[row]; /* an average continues through what it excludes */
    f.moving = in->moving && in->moving[row];
    f.excited_above = excited_share * *largest;
    const int64_t count = *counted + (j->s->averages && f.usable);
    if (known->before != *counted || known->count != count) { /* most places of a period have as many */
        *known = lb_facts_of(j, *counted, count);
    }
    f.several = lb_is_finite(known->dof_scatter);
    f.dof = f.moving ? known->dof_moving : known->dof;
    f.least_dof = lb_all(LB_INFINITE);
    f.widened = lb_no_lane();
    lb_judge_changes(j, &f);
    *counted += f.usable;
    size_t first = 0;
    for (; j->m->lines - first >= LB_LANES; first += LB_LANES) {
        process_lines(j, &f, first, LB_LANES);
    }
    if (first < j->m->lines) {
        process_lines(j, &f, first, j->m->lines - first);
    }
    lb_write_changes(j, &f);
    j->out->dof[row] = dof_of(&f);
    j->out->usable[row] = (uint8_t)f.usable;
    if (j->s->averages) {
        average_moment(j, &f);
    }
    write_moment(j, &f, j->s->averages && *counted > 0);
}

void LB_LINES_NAME(const lb_line_job *job_, double *largest)
{
    /* Copies that no store of a result can change, so that they stay in registers. */
    const lb_line_weights weights = *job_->weights;
    const lb_line_moments moments = *job_->m;
    const lb_line_settings settings = *job_->s;
    const lb_line_windows windows = *job_->in;
    const lb_line_rows rows = *job_->out;
    const lb_line_job j = {&weights, &moments, &settings, &windows, &rows};
    lb_weight_facts known = {.before = -1};
    size_t place = windows.place;
    double most = *largest;
    for (size_t row = 0; row < windows.rows; ++row) {
        process_row(&j, row, place, &most, &known);
        place = place + 1u < moments.places ? place + 1u : 0u;
    }
    *largest = most;
}
