/* The number type of this object: compile with LB_BITS=32 or 64. Private. */
#ifndef LB_REAL_H
#define LB_REAL_H

#include "lb_assert.h"
#include "livebode/sdft.h"

#if LB_BITS == 64
typedef double real;
typedef int64_t lb_lane_index;
#define LB_DFT lb_sdft64
#define LB(name) lb_sdft64_##name
#elif LB_BITS == 32
typedef float real;
typedef int32_t lb_lane_index;
#define LB_DFT lb_sdft32
#define LB(name) lb_sdft32_##name
#else
#error "compile with -DLB_BITS=32 or -DLB_BITS=64"
#endif

/* Bins are padded to blocks of 64 bytes, the widest vector; without vectors (one.c) not at all. */
#if !defined(LB_SCALAR) && !(defined(__GNUC__) || defined(__clang__))
#define LB_SCALAR 1
#endif
#ifdef LB_SCALAR
#define LB_BLOCK 1
#else
#define LB_BLOCK (512 / LB_BITS)
#endif

/* Samples per update of the sums: enough that loading and storing the sums is cheap. */
#if !defined(LB_TILE) && defined(LB_SCALAR)
#define LB_TILE 0 /* no sample waits */
#elif !defined(LB_TILE)
#define LB_TILE 128
#endif

#endif
