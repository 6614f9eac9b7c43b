/* Distances of capsules and their gradients (`pair_distances.py`, `segments.py`). */

#include "spatial.h"

#define POINT 1e-18    /* squared length [m²] below which a segment is a point */
#define PARALLEL 1e-12 /* squared sine of the angle below which segments are parallel */

static inline double clipped(double x) { return x < 0.0 ? 0.0 : (x > 1.0 ? 1.0 : x); }

/* segments.nearest_points for one pair: the gap (3), and the share of the first segment. */
static inline double nearest(const double *first, const double *along, const double *second,
                             const double *other, double *gap)
{
    double between[3];
    for (int i = 0; i < 3; i++)
        between[i] = first[i] - second[i];
    double aa = dot(along, along), bb = dot(other, other), ab = dot(along, other);
    double aw = dot(along, between), bw = dot(other, between);
    double safe_aa = aa > POINT ? aa : POINT, safe_bb = bb > POINT ? bb : POINT;
    double determinant = aa * bb - ab * ab, s;
    if (determinant > PARALLEL * safe_aa * safe_bb) {
        s = clipped((ab * bw - bb * aw) / determinant);
    } else if (aa > POINT) { /* the middle of what is level with the other */
        double one = clipped(-aw / safe_aa), two = clipped((ab - aw) / safe_aa);
        s = (one + two) / 2;
    } else {
        s = 0.0;
    }
    double t = clipped((s * ab + bw) / safe_bb);
    s = clipped((t * ab - aw) / safe_aa);
    for (int i = 0; i < 3; i++)
        gap[i] = t * other[i] - s * along[i] - between[i];
    return s;
}

/* Start and vector of a capsule's axis in the world; joint 0 is the world itself. */
static inline void in_world(index_t joint, const double *start, const double *along,
                            const double *rotation, const double *place, double *world)
{
    if (joint == 0) {
        memcpy(world, start, 3 * sizeof *world);
        memcpy(world + 3, along, 3 * sizeof *world);
        return;
    }
    turned(rotation + 9 * (joint - 1), start, world);
    for (int i = 0; i < 3; i++)
        world[i] += place[3 * (joint - 1) + i];
    turned(rotation + 9 * (joint - 1), along, world + 3);
}

/* PairDistances.distances: (T, P); `work` holds 9 doubles per capsule. */
EXPORT void distances(index_t samples, index_t bodies, index_t capsules, index_t pairs,
                      const index_t *joints, const double *start, const double *along,
                      const index_t *first, const index_t *second, const double *radii,
                      const double *balls, double exact_below, const double *rotations,
                      const double *translations, double *work, double *found)
{
    double *middle = work + 6 * capsules;
    for (index_t t = 0; t < samples; t++) {
        for (index_t c = 0; c < capsules; c++) {
            double *world = work + 6 * c;
            in_world(joints[c], start + 3 * c, along + 3 * c, rotations + 9 * bodies * t,
                     translations + 3 * bodies * t, world);
            for (int i = 0; i < 3; i++)
                middle[3 * c + i] = world[i] + 0.5 * world[3 + i];
        }
        for (index_t p = 0; p < pairs; p++) {
            const double *one = work + 6 * first[p], *two = work + 6 * second[p];
            double gap[3], bound;
            for (int i = 0; i < 3; i++)
                gap[i] = middle[3 * first[p] + i] - middle[3 * second[p] + i];
            bound = sqrt(dot(gap, gap)) - balls[p];
            if (bound < exact_below) {
                nearest(one, one + 3, two, two + 3, gap);
                bound = sqrt(dot(gap, gap)) - radii[p];
            }
            found[pairs * t + p] = bound;
        }
    }
}

/* PairDistances.gradients: (K, n), NaN in the first entry where the segments cross. */
EXPORT void gradients(index_t count, index_t bodies, index_t dofs, index_t n,
                      const index_t *joints, const double *start, const double *along,
                      const index_t *first, const index_t *second, const double *sign,
                      const index_t *moved, const double *rotations, const double *translations,
                      const double *columns, const index_t *times, const index_t *pair,
                      double *found)
{
    for (index_t k = 0; k < count; k++) {
        index_t t = times[k], p = pair[k], f = first[p], s = second[p];
        const double *rotation = rotations + 9 * bodies * t, *place = translations + 3 * bodies * t;
        double one[6], two[6], gap[3], point[3], wrench[6];
        in_world(joints[f], start + 3 * f, along + 3 * f, rotation, place, one);
        in_world(joints[s], start + 3 * s, along + 3 * s, rotation, place, two);
        double share = nearest(one, one + 3, two, two + 3, gap);
        double length = sqrt(dot(gap, gap));
        if (length < 1e-10) {
            found[n * k] = NAN;
            continue;
        }
        for (int i = 0; i < 3; i++) {
            point[i] = one[i] + share * one[3 + i] + 0.5 * gap[i];
            wrench[i] = gap[i] / length;
        }
        cross(point, wrench, wrench + 3);
        for (index_t j = 0; j < n; j++) {
            double side = sign[n * p + j];
            found[n * k + j] =
                side == 0.0 ? 0.0 : side * dot6(columns + 6 * (dofs * t + moved[j]), wrench);
        }
    }
}
