/* What the files of the belt share. Private.
 *
 * Lines are computed LB_LANES at a time; a tile that is not full is padded with the first line and weight zero. */
#ifndef LB_BELT_PRIVATE_H
#define LB_BELT_PRIVATE_H

#include "../elementary.h"
#include "livebode/belt.h"

#define LB_LANES 8u
#define LB_SLOPES 5u /* by the parameters, and by a delay */
#define LB_TERMS 21u /* products of slopes and of the rest, each pair once */

typedef struct {
    double re[LB_LANES], im[LB_LANES];
} lb_lanes;

/* w = z − 1, w², and T/w: the response of an inertia of 1. */
typedef struct {
    lb_lanes w, square, rigid;
    double theta[LB_LANES];
} lb_belt_tile;

/* α·T/w + β·g·w/(w² − sum·w + product), and slopes: of α and β by both inertias, of the rest by δ and Ω, of these by
 * the parameters. */
typedef struct {
    double alpha, beta, g, sum, product;
    double alpha_by[2], beta_by[2];
    double g_by[2], sum_by[2], product_by[2];
    double delta_by[LB_BELT_PARAMETERS], omega_by[LB_BELT_PARAMETERS];
} lb_mode;

static inline size_t lb_tiles(size_t lines) { return (lines + LB_LANES - 1u) / LB_LANES; }

/* mode.c */
lb_mode lb_mode_of(const double *parameters, double tick);
void lb_belt_tiles_of(const lb_belt_grid *grid, lb_belt_tile *tiles);
void lb_belt_evaluate(const lb_mode *m, const lb_belt_tile *at, lb_lanes *response);
void lb_belt_slopes(const lb_mode *m, const lb_belt_tile *at, lb_lanes *response, lb_lanes slope[LB_SLOPES]);

#endif
