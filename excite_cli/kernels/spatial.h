/* Vectors of space, motions and forces, for the kernels; everything is inline. */

#ifndef EXCITE_SPATIAL_H
#define EXCITE_SPATIAL_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef int64_t index_t;

static inline void cross(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double dot6(const double *a, const double *b) { return dot(a, b) + dot(a + 3, b + 3); }

/* out = R x */
static inline void turned(const double *r, const double *x, double *out)
{
    for (int i = 0; i < 3; i++)
        out[i] = dot(r + 3 * i, x);
}

/* out = Rᵀ x */
static inline void turned_back(const double *r, const double *x, double *out)
{
    for (int i = 0; i < 3; i++)
        out[i] = r[i] * x[0] + r[3 + i] * x[1] + r[6 + i] * x[2];
}

/* Spatial a × b of motions [linear; angular]. */
static inline void motion_cross(const double *a, const double *b, double *out)
{
    double one[3], two[3];
    cross(a + 3, b, one);
    cross(a, b + 3, two);
    for (int i = 0; i < 3; i++)
        out[i] = one[i] + two[i];
    cross(a + 3, b + 3, out + 3);
}

/* Spatial a ×* f of a motion and a force. */
static inline void force_cross(const double *a, const double *f, double *out)
{
    double one[3], two[3];
    cross(a + 3, f, out);
    cross(a, f, one);
    cross(a + 3, f + 3, two);
    for (int i = 0; i < 3; i++)
        out[3 + i] = one[i] + two[i];
}

/* A motion or force about the world origin, seen from a body: linear + angular × p, both turned. */
static inline void to_local(const double *r, const double *p, const double *spatial, double *out)
{
    double moved[3];
    cross(spatial + 3, p, moved);
    for (int i = 0; i < 3; i++)
        moved[i] += spatial[i];
    turned_back(r, moved, out);
    turned_back(r, spatial + 3, out + 3);
}

static inline void force_to_world(const double *r, const double *p, const double *force, double *out)
{
    double moment[3];
    turned(r, force, out);
    turned(r, force + 3, out + 3);
    cross(p, out, moment);
    for (int i = 0; i < 3; i++)
        out[3 + i] += moment[i];
}

/* The motion column of a joint with this twist, about the world origin. */
static inline void column(const double *r, const double *p, const double *axis, double *out)
{
    double lever[3];
    turned(r, axis, out);
    turned(r, axis + 3, out + 3);
    cross(p, out + 3, lever);
    for (int i = 0; i < 3; i++)
        out[i] += lever[i];
}

#endif
