/* Inner loops over instants, bodies and pairs that NumPy can only take as many passes over memory.

   Every function repeats, operation by operation, what the Python function of the same name beside
   it computes; that one is the reference of the tests, and is used where this file could not be
   compiled. Arrays are C-contiguous doubles and 64-bit integers; nothing is allocated or kept. */

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

/* BatchKinematics.placements: rotations (T, B, 3, 3) and translations (T, B, 3). */
EXPORT void placements(index_t samples, index_t bodies, index_t joints, const index_t *parents,
                       const index_t *variable, const double *basis, const double *offset,
                       const double *slide, const double *q, double *rotations,
                       double *translations)
{
    for (index_t t = 0; t < samples; t++) {
        double *rotation = rotations + 9 * bodies * t, *place = translations + 3 * bodies * t;
        for (index_t b = 0; b < bodies; b++) {
            const double *term = basis + 27 * b;
            double local[9], shift[3];
            double angle = variable[b] < 0 ? 0.0 : q[joints * t + variable[b]];
            double s = sin(angle), c = cos(angle);
            for (int k = 0; k < 9; k++)
                local[k] = term[k] + s * term[9 + k] + c * term[18 + k];
            for (int k = 0; k < 3; k++)
                shift[k] = offset[3 * b + k] + angle * slide[3 * b + k];
            if (parents[b] < 0) {
                memcpy(rotation + 9 * b, local, sizeof local);
                memcpy(place + 3 * b, shift, sizeof shift);
                continue;
            }
            const double *above = rotation + 9 * parents[b], *from = place + 3 * parents[b];
            for (int i = 0; i < 3; i++) {
                for (int j = 0; j < 3; j++)
                    rotation[9 * b + 3 * i + j] = above[3 * i] * local[j] +
                                                  above[3 * i + 1] * local[3 + j] +
                                                  above[3 * i + 2] * local[6 + j];
                place[3 * b + i] = from[i] + dot(above + 3 * i, shift);
            }
        }
    }
}

static inline void column(const double *r, const double *p, const double *axis, double *out)
{
    double lever[3];
    turned(r, axis, out);
    turned(r, axis + 3, out + 3);
    cross(p, out + 3, lever);
    for (int i = 0; i < 3; i++)
        out[i] += lever[i];
}

/* BatchKinematics.axes: Jacobian columns (T, V, 6). */
EXPORT void axes(index_t samples, index_t bodies, index_t dofs, const index_t *dof_body,
                 const double *axis, const double *rotations, const double *translations,
                 double *columns)
{
    for (index_t t = 0; t < samples; t++)
        for (index_t d = 0; d < dofs; d++) {
            index_t at = bodies * t + dof_body[d];
            column(rotations + 9 * at, translations + 3 * at, axis + 6 * d,
                   columns + 6 * (dofs * t + d));
        }
}

/* Y_j z (6) of one body from its local velocity and [point acceleration; angular acceleration]. */
static inline void body_force(const double *velocity, const double *acceleration, const double *z,
                              double *out)
{
    const double *spin = velocity + 3, *point = acceleration, *turn = acceleration + 3;
    const double *first = z + 1, *inertia = z + 4;
    double a[3], b[3], c[3], momentum[3], change[3];
    cross(turn, first, a);
    cross(spin, first, b);
    cross(spin, b, c);
    for (int i = 0; i < 3; i++)
        out[i] = point[i] * z[0] + a[i] + c[i];
    momentum[0] = inertia[0] * spin[0] + inertia[1] * spin[1] + inertia[3] * spin[2];
    momentum[1] = inertia[1] * spin[0] + inertia[2] * spin[1] + inertia[4] * spin[2];
    momentum[2] = inertia[3] * spin[0] + inertia[4] * spin[1] + inertia[5] * spin[2];
    change[0] = inertia[0] * turn[0] + inertia[1] * turn[1] + inertia[3] * turn[2];
    change[1] = inertia[1] * turn[0] + inertia[2] * turn[1] + inertia[4] * turn[2];
    change[2] = inertia[3] * turn[0] + inertia[4] * turn[1] + inertia[5] * turn[2];
    cross(first, point, a);
    cross(spin, momentum, b);
    for (int i = 0; i < 3; i++)
        out[3 + i] = a[i] + change[i] + b[i];
}

/* Gradients (6 each) of P : Y_j with respect to the local velocity and acceleration of a body. */
static void body_gradients(const double *p, const double *velocity, const double *acceleration,
                           const double *by_spin_once, const double *by_spin_twice,
                           double *by_velocity, double *by_acceleration)
{
    double first[9], inertia[18], quadratic[9], by_turn[3] = {0, 0, 0}, by_spin[3], moved[3];
    const double *linear = velocity, *spin = velocity + 3;
    double *by_point = by_acceleration;
    (void)acceleration;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            first[3 * i + j] = p[10 * i + 1 + j];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 6; j++)
            inertia[6 * i + j] = p[10 * (3 + i) + 4 + j];
    const double *one = p + 31, *two = p + 41, *three = p + 51; /* rows of P[3:, 1:4] */
    by_point[0] = p[0] - (three[1] - two[2]);
    by_point[1] = p[10] - (one[2] - three[0]);
    by_point[2] = p[20] - (two[0] - one[1]);
    memset(quadratic, 0, sizeof quadratic);
    for (int k = 0; k < 18; k++) {
        for (int j = 0; j < 3; j++)
            by_turn[j] += inertia[k] * by_spin_once[3 * k + j];
        for (int j = 0; j < 9; j++)
            quadratic[j] += inertia[k] * by_spin_twice[9 * k + j];
    }
    by_turn[0] += first[7] - first[5];
    by_turn[1] += first[2] - first[6];
    by_turn[2] += first[3] - first[1];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            quadratic[3 * i + j] += first[3 * i + j] + first[3 * j + i];
    double trace = 2 * (first[0] + first[4] + first[8]);
    turned(quadratic, spin, by_spin);
    cross(by_point, spin, by_velocity);
    cross(linear, by_point, moved);
    for (int i = 0; i < 3; i++) {
        by_velocity[3 + i] = by_spin[i] - trace * spin[i] + moved[i];
        by_acceleration[3 + i] = by_turn[i];
    }
}

/* SpatialAdjoint.pull_back_dense: ∂/∂(q, v, a) of Σ_t Z_t : Y(x_t), each (T, n).

   carries (B, V): 1 where the degree of freedom carries the body. `work` holds per instant, in
   this order: columns, rates (6 V each), V, A, local V, local A, gradients by both, forces (6 B
   each). */
EXPORT void pull_back(index_t samples, index_t bodies, index_t dofs, index_t n, index_t rows,
                      const index_t *parents, const index_t *dof_body, const index_t *variable,
                      const index_t *moved, const index_t *row_dof, const double *carries,
                      const double *axis, const double *gravity, const double *by_spin_once,
                      const double *by_spin_twice, const double *rotations,
                      const double *translations, const double *v, const double *a,
                      const double *weights, double *work, double *gq, double *gv, double *ga)
{
    double *columns = work, *rates = columns + 6 * dofs, *velocity = rates + 6 * dofs;
    double *acceleration = velocity + 6 * bodies, *local_v = acceleration + 6 * bodies;
    double *local_a = local_v + 6 * bodies, *by_v = local_a + 6 * bodies;
    double *by_a = by_v + 6 * bodies, *forces = by_a + 6 * bodies;
    for (index_t t = 0; t < samples; t++) {
        const double *rotation = rotations + 9 * bodies * t, *place = translations + 3 * bodies * t;
        const double *z = weights + 10 * bodies * rows * t;
        for (index_t d = 0; d < dofs; d++)
            column(rotation + 9 * dof_body[d], place + 3 * dof_body[d], axis + 6 * d,
                   columns + 6 * d);
        for (index_t b = 0; b < bodies; b++) {
            double *vel = velocity + 6 * b, *acc = acceleration + 6 * b;
            if (parents[b] < 0) {
                memset(vel, 0, 6 * sizeof *vel);
                memcpy(acc, gravity, 6 * sizeof *acc);
            } else {
                memcpy(vel, velocity + 6 * parents[b], 6 * sizeof *vel);
                memcpy(acc, acceleration + 6 * parents[b], 6 * sizeof *acc);
            }
            if (variable[b] >= 0) { /* one moved joint */
                index_t k = variable[b], d = moved[k];
                double rate[6];
                for (int i = 0; i < 6; i++)
                    vel[i] += columns[6 * d + i] * v[n * t + k];
                motion_cross(vel, columns + 6 * d, rate);
                for (int i = 0; i < 6; i++)
                    acc[i] += columns[6 * d + i] * a[n * t + k] + rate[i] * v[n * t + k];
                memcpy(rates + 6 * d, rate, sizeof rate);
            }
            to_local(rotation + 9 * b, place + 3 * b, vel, local_v + 6 * b);
            to_local(rotation + 9 * b, place + 3 * b, acc, local_a + 6 * b);
            double turning[3];
            cross(local_v + 6 * b + 3, local_v + 6 * b, turning);
            for (int i = 0; i < 3; i++)
                local_a[6 * b + i] += turning[i];
        }
        for (index_t b = 0; b < bodies; b++) {
            double p[60], local[6], world[6];
            memset(p, 0, sizeof p);
            for (index_t r = 0; r < rows; r++) {
                index_t d = row_dof[r];
                if (carries[dofs * b + d] == 0.0)
                    continue;
                const double *zb = z + 10 * (bodies * r + b);
                to_local(rotation + 9 * b, place + 3 * b, columns + 6 * d, local);
                for (int i = 0; i < 6; i++)
                    for (int j = 0; j < 10; j++)
                        p[10 * i + j] += local[i] * zb[j];
            }
            double gv_local[6], ga_local[6], extra[6];
            body_gradients(p, local_v + 6 * b, local_a + 6 * b, by_spin_once, by_spin_twice,
                           gv_local, ga_local);
            force_to_world(rotation + 9 * b, place + 3 * b, gv_local, by_v + 6 * b);
            force_to_world(rotation + 9 * b, place + 3 * b, ga_local, world);
            force_cross(velocity + 6 * b, world, extra);
            for (int i = 0; i < 6; i++) {
                by_a[6 * b + i] = world[i];
                by_v[6 * b + i] += extra[i];
            }
        }
        for (index_t b = bodies - 1; b >= 0; b--)
            if (parents[b] >= 0)
                for (int i = 0; i < 6; i++) {
                    by_a[6 * parents[b] + i] += by_a[6 * b + i];
                    by_v[6 * parents[b] + i] += by_v[6 * b + i];
                }
        for (index_t k = 0; k < n; k++) {
            const double *s = columns + 6 * moved[k], *rate = rates + 6 * moved[k];
            index_t b = dof_body[moved[k]];
            double second[6], other[6];
            motion_cross(acceleration + 6 * b, s, second);
            motion_cross(velocity + 6 * b, rate, other);
            for (int i = 0; i < 6; i++)
                second[i] += other[i];
            gq[n * t + k] = dot6(second, by_a + 6 * b) + dot6(rate, by_v + 6 * b);
            gv[n * t + k] = 2 * dot6(rate, by_a + 6 * b) + dot6(s, by_v + 6 * b);
            ga[n * t + k] = dot6(s, by_a + 6 * b);
        }
        for (index_t r = 0; r < rows; r++) {
            index_t d = row_dof[r], from = dof_body[d];
            for (index_t b = from; b < bodies; b++) {
                if (carries[dofs * b + d] == 0.0)
                    continue;
                double local[6];
                body_force(local_v + 6 * b, local_a + 6 * b, z + 10 * (bodies * r + b), local);
                force_to_world(rotation + 9 * b, place + 3 * b, local, forces + 6 * b);
            }
            for (index_t b = bodies - 1; b > from; b--) { /* children come after their parents */
                if (carries[dofs * b + d] == 0.0)
                    continue;
                if (variable[b] >= 0) {
                    double change[6];
                    force_cross(columns + 6 * d, forces + 6 * b, change);
                    gq[n * t + variable[b]] -= dot6(columns + 6 * moved[variable[b]], change);
                }
                for (int i = 0; i < 6; i++)
                    forces[6 * parents[b] + i] += forces[6 * b + i];
            }
        }
    }
}

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

/* residuals.squared_per_instant for one pair of orders: Σ weight·g hᵀ per instant, (T, n, n). */
EXPORT void squared(index_t count, index_t n, const index_t *times, const double *weights,
                    const double *left, const double *right, double *found)
{
    for (index_t k = 0; k < count; k++) {
        double *block = found + n * n * times[k];
        const double *g = left + n * k, *h = right + n * k;
        for (index_t i = 0; i < n; i++) {
            double scaled = weights[k] * g[i];
            if (scaled == 0.0)
                continue;
            for (index_t j = 0; j < n; j++)
                block[n * i + j] += scaled * h[j];
        }
    }
}

/* The four cubic B-splines that are not zero at x (clipped to the knots), their slopes, and the
   index of the first; `knots` are `count`, four times the same at both ends. */
static index_t cubic(index_t count, const double *knots, double x, double *value, double *slope)
{
    index_t low = 3, high = count - 4;
    x = x < knots[low] ? knots[low] : (x > knots[high] ? knots[high] : x);
    while (high - low > 1) {
        index_t middle = (low + high) / 2;
        if (x >= knots[middle])
            low = middle;
        else
            high = middle;
    }
    double left[4], right[4], lower[3];
    value[0] = 1.0;
    for (int degree = 1; degree <= 3; degree++) {
        double carried = 0.0;
        left[degree] = x - knots[low + 1 - degree];
        right[degree] = knots[low + degree] - x;
        if (degree == 3)
            memcpy(lower, value, sizeof lower);
        for (int r = 0; r < degree; r++) {
            double part = value[r] / (right[r + 1] + left[degree - r]);
            value[r] = carried + right[r + 1] * part;
            carried = left[degree - r] * part;
        }
        value[degree] = carried;
    }
    for (int r = 0; r < 4; r++) {
        double before = r > 0 ? lower[r - 1] / (knots[low + r] - knots[low - 3 + r]) : 0.0;
        double after = r < 3 ? lower[r] / (knots[low + 1 + r] - knots[low - 2 + r]) : 0.0;
        slope[r] = 3.0 * (before - after);
    }
    return low - 3;
}

/* PairTable: value and both slopes (T, 3) of a bicubic spline at positions (T, 2). */
EXPORT void bicubic(index_t count, index_t first_knots, index_t second_knots, const double *first,
                    const double *second, const double *coefficients, const double *at,
                    double *found)
{
    index_t across = second_knots - 4;
    for (index_t t = 0; t < count; t++) {
        double u[4], du[4], w[4], dw[4];
        index_t i = cubic(first_knots, first, at[2 * t], u, du);
        index_t j = cubic(second_knots, second, at[2 * t + 1], w, dw);
        double value = 0.0, by_first = 0.0, by_second = 0.0;
        for (int k = 0; k < 4; k++) {
            const double *c = coefficients + across * (i + k) + j;
            double along = c[0] * w[0] + c[1] * w[1] + c[2] * w[2] + c[3] * w[3];
            value += u[k] * along;
            by_first += du[k] * along;
            by_second += u[k] * (c[0] * dw[0] + c[1] * dw[1] + c[2] * dw[2] + c[3] * dw[3]);
        }
        found[3 * t] = value;
        found[3 * t + 1] = by_first;
        found[3 * t + 2] = by_second;
    }
}

/* Raised, here and in kernels.py, when a function takes other arguments. */
EXPORT int version(void) { return 1; }

/* setuptools asks for this name on some systems. The library is no module and is never imported: it
   needs no headers of Python, and one build serves all its versions. */
EXPORT void *PyInit__kernels(void) { return 0; }
