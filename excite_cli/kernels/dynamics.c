/* The regressor and its pull-back (`spatial_adjoint.py`). */

#include "spatial.h"

/* A robot as all instants see it. */
typedef struct {
    index_t bodies, dofs;
    const index_t *parents, *dof_body, *variable, *moved;
    const double *axis, *gravity;
} tree_t;

/* Of one instant: columns and rates (6 per degree of freedom), velocities and accelerations (6 per
   body) in the world and, with that of the point that stands at the body's origin, locally. */
static void motions(const tree_t *tree, const double *rotation, const double *place,
                    const double *v, const double *a, double *columns, double *rates,
                    double *velocity, double *acceleration, double *local_v, double *local_a)
{
    for (index_t d = 0; d < tree->dofs; d++)
        column(rotation + 9 * tree->dof_body[d], place + 3 * tree->dof_body[d], tree->axis + 6 * d,
               columns + 6 * d);
    for (index_t b = 0; b < tree->bodies; b++) {
        double *vel = velocity + 6 * b, *acc = acceleration + 6 * b;
        if (tree->parents[b] < 0) {
            memset(vel, 0, 6 * sizeof *vel);
            memcpy(acc, tree->gravity, 6 * sizeof *acc);
        } else {
            memcpy(vel, velocity + 6 * tree->parents[b], 6 * sizeof *vel);
            memcpy(acc, acceleration + 6 * tree->parents[b], 6 * sizeof *acc);
        }
        if (tree->variable[b] >= 0) { /* one moved joint */
            index_t k = tree->variable[b], d = tree->moved[k];
            double rate[6];
            for (int i = 0; i < 6; i++)
                vel[i] += columns[6 * d + i] * v[k];
            motion_cross(vel, columns + 6 * d, rate);
            for (int i = 0; i < 6; i++)
                acc[i] += columns[6 * d + i] * a[k] + rate[i] * v[k];
            memcpy(rates + 6 * d, rate, sizeof rate);
        }
        to_local(rotation + 9 * b, place + 3 * b, vel, local_v + 6 * b);
        to_local(rotation + 9 * b, place + 3 * b, acc, local_a + 6 * b);
        double turning[3];
        cross(local_v + 6 * b + 3, local_v + 6 * b, turning);
        for (int i = 0; i < 3; i++)
            local_a[6 * b + i] += turning[i];
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
    const tree_t robot = {bodies, dofs, parents, dof_body, variable, moved, axis, gravity};
    const tree_t *tree = &robot;
    for (index_t t = 0; t < samples; t++) {
        const double *rotation = rotations + 9 * bodies * t, *place = translations + 3 * bodies * t;
        const double *z = weights + 10 * bodies * rows * t;
        motions(tree, rotation, place, v + n * t, a + n * t, columns, rates, velocity,
                acceleration, local_v, local_a);
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

/* The regressor (T, R, kept): entry `position` (10 B) of a parameter's column, -1 where it is not
   kept. `work` as of pull_back, its first 12 V + 24 B. */
EXPORT void regressor(index_t samples, index_t bodies, index_t dofs, index_t n, index_t rows,
                      const index_t *parents, const index_t *dof_body, const index_t *variable,
                      const index_t *moved, const index_t *row_dof, const double *carries,
                      const double *axis, const double *gravity, const double *rotations,
                      const double *translations, const double *v, const double *a,
                      const index_t *position, index_t kept, double *work, double *found)
{
    double *columns = work, *rates = columns + 6 * dofs, *velocity = rates + 6 * dofs;
    double *acceleration = velocity + 6 * bodies, *local_v = acceleration + 6 * bodies;
    double *local_a = local_v + 6 * bodies;
    const tree_t robot = {bodies, dofs, parents, dof_body, variable, moved, axis, gravity};
    for (index_t t = 0; t < samples; t++) {
        const double *rotation = rotations + 9 * bodies * t, *place = translations + 3 * bodies * t;
        motions(&robot, rotation, place, v + n * t, a + n * t, columns, rates, velocity,
                acceleration, local_v, local_a);
        for (index_t r = 0; r < rows; r++) {
            index_t d = row_dof[r];
            double *row = found + kept * (rows * t + r);
            for (index_t b = dof_body[d]; b < bodies; b++) {
                if (carries[dofs * b + d] == 0.0)
                    continue;
                const double *spin = local_v + 6 * b + 3, *point = local_a + 6 * b;
                const double *turn = local_a + 6 * b + 3;
                double local[6], all[10], one[3], two[3], three[3], u[3];
                const double *f = local, *m = local + 3;
                to_local(rotation + 9 * b, place + 3 * b, columns + 6 * d, local);
                all[0] = dot(f, point);
                cross(f, turn, one);
                cross(f, spin, u);
                cross(u, spin, two);
                cross(m, point, three);
                for (int i = 0; i < 3; i++)
                    all[1 + i] = one[i] + two[i] - three[i];
                cross(m, spin, u);
                all[4] = m[0] * turn[0] + u[0] * spin[0];
                all[5] = m[0] * turn[1] + m[1] * turn[0] + u[0] * spin[1] + u[1] * spin[0];
                all[6] = m[1] * turn[1] + u[1] * spin[1];
                all[7] = m[0] * turn[2] + m[2] * turn[0] + u[0] * spin[2] + u[2] * spin[0];
                all[8] = m[1] * turn[2] + m[2] * turn[1] + u[1] * spin[2] + u[2] * spin[1];
                all[9] = m[2] * turn[2] + u[2] * spin[2];
                for (int k = 0; k < 10; k++)
                    if (position[10 * b + k] >= 0)
                        row[position[10 * b + k]] = all[k];
            }
        }
    }
}
