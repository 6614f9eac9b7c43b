/* @ROBOT@: joint torques of an identified model. @MADE@
 *
 * Standard C99, no dependency but the C library's <tgmath.h>, no allocation, no global state.
 * Compile with -DEXCITE_FLOAT for single precision, with -DEXCITE_MAIN for a program that tests
 * itself (exit status 0: the recorded torques come out) and prints the time of a call.
 *
 * excite_torque    torque at the next instant of a series, with what came before in `memory`
 * excite_series    torque at all instants of a recorded series, as the program's error table has it
 * excite_state     torque in a state by itself: as at the first instant of a series
 * excite_load      torque of the rigid bodies alone
 * excite_friction  torque of all friction that needs no series, at a given load of the gears
 * excite_std       standard deviation of the torque in a state by itself@NO_STD@
 * excite_self_test largest deviation from recorded torques, relative to the largest of them
 * excite_detect    whether a residual says collision (where thresholds were given)
 *
 * All arrays have EXCITE_JOINTS entries per instant, in this order:
@JOINTS@
 * Units: rad, rad/s, rad/s^2, N.m (sliding joints: m, N). Columns of the log, EXCITE_COLUMNS per
 * instant (NULL if there are none):
@COLUMNS@
 * Effects in it:
@EFFECTS@
 * Not in it:
@LEFT@
 * Rates of torques (elastic gears, delays) are central differences in excite_series and backward
 * ones in excite_torque, which cannot look ahead and knows no backlash; all else is the same in both.
 *
 * What is not finite: NaN, +-Inf, and numbers whose square overflows (beyond 6e153, with EXCITE_FLOAT
 * 9e18), in what a function is given or in what comes out of it. Such an instant
 *   - is a contact: excite_detect answers 1 for it;
 *   - has the torque NaN on all joints, and excite_torque and excite_load return 1 (else 0),
 *     excite_series the number of such instants;
 *   - never enters a memory or a filter: these keep their last finite values, its time passes, and
 *     the next finite instant is answered as usual.
 * A step that is not finite or not above 0 (or a start that is not finite) makes every instant such
 * a one until the next begin with a good step; what begins a series returns 1 for a bad step.
 * Numbers are judged by their bits, which holds with -ffast-math and -Ofast, too. A controller must
 * not apply a torque of an instant for which 1 was returned.
 */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <tgmath.h>

#ifdef EXCITE_FLOAT
typedef float real;
#else
typedef double real;
#endif
#define R(x) ((real)(x))

/* Exponent bits: all of them are set in what is no finite number; from SQUARES on its square is none. */
#if defined(EXCITE_FLOAT) || DBL_MANT_DIG == FLT_MANT_DIG
typedef uint32_t bits;
#define EXPONENT ((bits)0xff << 23)
#define SQUARES ((bits)(127 + 63) << 23)
#else
typedef uint64_t bits;
#define EXPONENT ((bits)0x7ff << 52)
#define SQUARES ((bits)(1023 + 511) << 52)
#endif

#define EXCITE_JOINTS @N@
#define EXCITE_COLUMNS @NCOLUMNS@
#define N EXCITE_JOINTS
#define M @M@ /* with the joints that follow others */
#define SIGN(x) tanh((x) / R(@WIDTH@))
#define RATES @RATES@ /* some effect looks at rates of torques */

/* What a model remembers of a series; excite_begin empties it. */
typedef struct {
    real step, start, t;     /* between instants [s]; time on the campaign's clock, and since */
    int usable;              /* whether step and start are */
    size_t count, last;      /* instants so far; the last finite one */
    size_t known, rated;     /* finite ones so far; those that differences may look back on */
    real since, before;      /* from the last finite one to this one [s], and to it from its last */
    real q[N], v[N];         /* of the last one, then of this one */
    real last_q[N], last_v[N];
    real bristle[N];         /* of friction with memory */
    real load[2][N], torque[2][N]; /* of the last two */
} excite_memory;

typedef struct {
    int parent, slides;      /* parent -1: the world */
    real rotation[9], position[3], axis[3];
    int driver;              /* it stands at multiplier * q[driver] + offset */
    real multiplier, offset;
} joint_of;

static const joint_of JOINT[M] = {
@TREE@
};
/* Mass, first moment, inertia (xx, xy, yy, xz, yz, zz) about the joint's frame. */
static const real BODY[M][10] = {
@BODIES@
};
/* The same with what the links carry. */
static const real LOADED[M][10] = {
@LOADED@
};
static const real GRAVITY[3] = {@GRAVITY@};
static const real STILL[M] = {0};

/* Whether all `count` numbers are finite, and their squares. The compiler may not guess what comes
 * out of something volatile, so that no option takes this test away. */
static int all_finite(size_t count, const real *x)
{
    volatile union { real number; bits all; } each;
    for (size_t i = 0; i < count; ++i) {
        each.number = x[i];
        if ((each.all & EXPONENT) >= SQUARES)
            return 0;
    }
    return 1;
}

/* NaN, or with `endless` infinity, whatever the compiler thinks of them. */
static void spoil(size_t count, real *x, int endless)
{
    const bits all = EXPONENT | (endless ? 0 : EXPONENT >> 1);
    for (size_t i = 0; i < count; ++i)
        memcpy(x + i, &all, sizeof(all));
}

static void cross(const real *x, const real *y, real *out)
{
    out[0] = x[1] * y[2] - x[2] * y[1];
    out[1] = x[2] * y[0] - x[0] * y[2];
    out[2] = x[0] * y[1] - x[1] * y[0];
}

/* Rotation (row by row) and place of joint j in its parent. */
static void place(int j, real q, real *r, real *p)
{
    const joint_of *own = &JOINT[j];
    const real *m = own->rotation, *u = own->axis;
    memcpy(p, own->position, 3 * sizeof(real));
    if (own->slides) {
        memcpy(r, m, 9 * sizeof(real));
        for (int i = 0; i < 3; ++i)
            p[i] += q * (m[3 * i] * u[0] + m[3 * i + 1] * u[1] + m[3 * i + 2] * u[2]);
        return;
    }
    const real c = cos(q), s = sin(q), d = 1 - c;
    const real turn[9] = {
        c + d * u[0] * u[0], d * u[0] * u[1] - s * u[2], d * u[0] * u[2] + s * u[1],
        d * u[1] * u[0] + s * u[2], c + d * u[1] * u[1], d * u[1] * u[2] - s * u[0],
        d * u[2] * u[0] - s * u[1], d * u[2] * u[1] + s * u[0], c + d * u[2] * u[2],
    };
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            r[3 * i + k] = m[3 * i] * turn[k] + m[3 * i + 1] * turn[3 + k] + m[3 * i + 2] * turn[6 + k];
}

static void into(const real *r, const real *x, real *out) /* out = r' x */
{
    for (int i = 0; i < 3; ++i)
        out[i] = r[i] * x[0] + r[3 + i] * x[1] + r[6 + i] * x[2];
}

static void out_of(const real *r, const real *x, real *out) /* out += r x */
{
    for (int i = 0; i < 3; ++i)
        out[i] += r[3 * i] * x[0] + r[3 * i + 1] * x[1] + r[3 * i + 2] * x[2];
}

static void spread(const real *q, const real *v, const real *a, real all[3][M])
{
    for (int j = 0; j < M; ++j) {
        const int driver = JOINT[j].driver;
        all[0][j] = JOINT[j].multiplier * q[driver] + JOINT[j].offset;
        all[1][j] = JOINT[j].multiplier * v[driver];
        all[2][j] = JOINT[j].multiplier * a[driver];
    }
}

static void gather(const real *all, real *out) /* out += what the followers ask of their drivers */
{
    for (int j = 0; j < M; ++j)
        out[JOINT[j].driver] += JOINT[j].multiplier * all[j];
}

/* Of all joints: frames in those of their parents; in their own frames angular velocity, angular
 * acceleration and acceleration of the origin, less gravity. */
typedef struct {
    real r[M][9], p[M][3], w[M][3], dw[M][3], acc[M][3];
} motion;

static inline void move(
    const real *gravity, const real *q, const real *v, const real *a, motion *at)
{
    static const real zero[3] = {0, 0, 0};
    const real up[3] = {-gravity[0], -gravity[1], -gravity[2]};
    for (int j = 0; j < M; ++j) {
        const int parent = JOINT[j].parent;
        const real *u = JOINT[j].axis, *p = at->p[j], *r = at->r[j];
        const real *w0 = parent < 0 ? zero : at->w[parent], *dw0 = parent < 0 ? zero : at->dw[parent];
        const real *acc0 = parent < 0 ? up : at->acc[parent];
        real *w = at->w[j], *dw = at->dw[j], *acc = at->acc[j], x[3], y[3], lifted[3];
        place(j, q[j], at->r[j], at->p[j]);
        cross(w0, p, x);
        cross(w0, x, y);
        cross(dw0, p, x);
        for (int i = 0; i < 3; ++i)
            lifted[i] = acc0[i] + x[i] + y[i];
        into(r, lifted, acc);
        into(r, w0, w);
        into(r, dw0, dw);
        cross(w, u, x);
        if (JOINT[j].slides) {
            for (int i = 0; i < 3; ++i)
                acc[i] += u[i] * a[j] + 2 * x[i] * v[j];
        } else {
            for (int i = 0; i < 3; ++i) {
                dw[i] += u[i] * a[j] + x[i] * v[j];
                w[i] += u[i] * v[j];
            }
        }
    }
}

/* Recursive Newton-Euler; every body by its ten parameters, in which it is linear. */
static void rigid_of_all(
    const real body[M][10], const real *gravity, const real *q, const real *v, const real *a, real *tau)
{
    motion at;
    real f[M][3], n[M][3];
    move(gravity, q, v, a, &at);
    for (int j = 0; j < M; ++j) {
        const real *ten = body[j], *h = ten + 1, *w = at.w[j], *dw = at.dw[j], *acc = at.acc[j];
        real x[3], y[3], z[3];
        cross(dw, h, x);
        cross(w, h, y);
        cross(w, y, z);
        for (int i = 0; i < 3; ++i)
            f[j][i] = ten[0] * acc[i] + x[i] + z[i];
        const real inertia[9] = {
            ten[4], ten[5], ten[7], ten[5], ten[6], ten[8], ten[7], ten[8], ten[9]};
        real spin[3] = {0, 0, 0}, moment[3] = {0, 0, 0};
        out_of(inertia, w, spin);
        out_of(inertia, dw, moment);
        cross(w, spin, x);
        cross(h, acc, y);
        for (int i = 0; i < 3; ++i)
            n[j][i] = moment[i] + x[i] + y[i];
    }
    for (int j = M - 1; j >= 0; --j) {
        const int parent = JOINT[j].parent;
        const real *u = JOINT[j].axis, *felt = JOINT[j].slides ? f[j] : n[j];
        tau[j] = u[0] * felt[0] + u[1] * felt[1] + u[2] * felt[2];
        if (parent >= 0) {
            real force[3] = {0, 0, 0}, lever[3];
            out_of(at.r[j], f[j], force);
            cross(at.p[j], force, lever);
            out_of(at.r[j], n[j], n[parent]);
            for (int i = 0; i < 3; ++i) {
                f[parent][i] += force[i];
                n[parent][i] += lever[i];
            }
        }
    }
}

static void rigid(
    const real body[M][10], const real *gravity, const real *q, const real *v, const real *a, real *tau)
{
    real all[3][M], torque[M];
    spread(q, v, a, all);
    rigid_of_all(body, gravity, all[0], all[1], all[2], torque);
    memset(tau, 0, N * sizeof(real));
    gather(torque, tau);
}

/* x dtau/dq_j + y dtau/dv_j + z dtau/da_j of the rigid bodies, exactly: torque is a polynomial of
 * second degree in v_j and in a sliding q_j, linear in a_j, and has angles q_j and 2 q_j only. */
static inline void slopes_of_all(
    const real *q, const real *v, const real *a, int j, real x, real y, real z, real *out)
{
    real state[M], ahead[M], behind[M];
    const real none[3] = {0, 0, 0};
    memset(out, 0, M * sizeof(real));
    memcpy(state, q, sizeof(state));
    if (x != 0) {
        const real near = R(0.78539816339744830962), far = R(1.57079632679489661923);
        const real weight[2] = {1, JOINT[j].slides ? 0 : (1 - sqrt(R(2.0))) / 2};
        const real shift[2] = {JOINT[j].slides ? R(0.5) : near, far};
        for (int k = 0; k < 2; ++k) {
            if (weight[k] == 0)
                continue;
            state[j] = q[j] + shift[k];
            rigid_of_all(BODY, GRAVITY, state, v, a, ahead);
            state[j] = q[j] - shift[k];
            rigid_of_all(BODY, GRAVITY, state, v, a, behind);
            for (int i = 0; i < M; ++i)
                out[i] += x * weight[k] * (ahead[i] - behind[i]);
        }
    }
    if (y != 0) {
        memcpy(state, v, sizeof(state));
        state[j] = v[j] + 1;
        rigid_of_all(BODY, none, q, state, STILL, ahead);
        state[j] = v[j] - 1;
        rigid_of_all(BODY, none, q, state, STILL, behind);
        for (int i = 0; i < M; ++i)
            out[i] += y * R(0.5) * (ahead[i] - behind[i]);
    }
    if (z != 0) {
        memset(state, 0, sizeof(state));
        state[j] = z;
        rigid_of_all(BODY, none, q, STILL, state, ahead);
        for (int i = 0; i < M; ++i)
            out[i] += ahead[i];
    }
}

/* The same of joint j with all that follow it. */
static inline void slopes(
    const real *q, const real *v, const real *a, int j, real x, real y, real z, real *out)
{
    real all[3][M], own[M];
    spread(q, v, a, all);
    memset(out, 0, N * sizeof(real));
    for (int k = 0; k < M; ++k)
        if (JOINT[k].driver == j) {
            const real m = JOINT[k].multiplier;
            slopes_of_all(all[0], all[1], all[2], k, m * x, m * y, m * z, own);
            gather(own, out);
        }
}

/* What gravity does more where the base is turned about the two axes that it is least along. */
static inline void tilted(real roll, real pitch, const real *q, real *out)
{
    int along = 0, next = 0;
    for (int i = 1; i < 3; ++i)
        if (fabs(GRAVITY[i]) > fabs(GRAVITY[along]))
            along = i;
    real change[3] = {0, 0, 0};
    for (int i = 0; i < 3; ++i)
        if (i != along) {
            real axis[3] = {0, 0, 0}, turned[3];
            axis[i] = next++ ? pitch : roll;
            cross(GRAVITY, axis, turned);
            for (int k = 0; k < 3; ++k)
                change[k] += turned[k];
        }
    rigid(LOADED, change, q, STILL, STILL, out);
}

/* J' f of a force in the world's axes at the frame of a joint. */
static inline void pushed(int joint, const real *force, const real *q, real *out)
{
    int last = 0;
    while (JOINT[last].driver != joint || JOINT[last].multiplier != 1)
        ++last;
    real all[3][M], r[M][9], p[M][3];
    spread(q, STILL, STILL, all);
    for (int j = 0; j < M; ++j) {
        const int parent = JOINT[j].parent;
        place(j, all[0][j], r[j], p[j]);
        if (parent >= 0) {
            real own[9], at[3];
            memcpy(own, r[j], sizeof(own));
            memcpy(at, p[parent], sizeof(at));
            out_of(r[parent], p[j], at);
            memcpy(p[j], at, sizeof(at));
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k)
                    r[j][3 * i + k] = r[parent][3 * i] * own[k] + r[parent][3 * i + 1] * own[3 + k]
                        + r[parent][3 * i + 2] * own[6 + k];
        }
    }
    memset(out, 0, N * sizeof(real));
    for (int j = last; j >= 0; j = JOINT[j].parent) {
        real axis[3] = {0, 0, 0}, arm[3], moved[3];
        out_of(r[j], JOINT[j].axis, axis);
        for (int i = 0; i < 3; ++i)
            arm[i] = p[last][i] - p[j][i];
        cross(axis, arm, moved);
        const real *way = JOINT[j].slides ? axis : moved;
        out[JOINT[j].driver] += JOINT[j].multiplier
            * (way[0] * force[0] + way[1] * force[1] + way[2] * force[2]);
    }
}

/* The bristle of a joint's friction with memory, one instant on. */
static inline real dahl(
    excite_memory *memory, int j, real distance, real sliding, real standing)
{
    const real q0 = memory->last_q[j], q1 = memory->q[j];
    const real v0 = memory->last_v[j], v1 = memory->v[j], step = memory->since;
    if (memory->known == 0)
        return memory->bristle[j] = tanh(v1 / sliding);
    const real between = v0 * v1 < 0 ? q0 + R(0.5) * step * v0 * v0 / (v0 - v1) : R(0.5) * (q0 + q1);
    const real way[2] = {between - q0, q1 - between};
    for (int k = 0; k < 2; ++k) {
        const real side = tanh(way[k] / (R(0.5) * step * standing));
        const real kept = exp(-side * way[k] / distance);
        const real sign = tanh(way[k] / (R(0.5) * step * R(@WIDTH@)));
        memory->bristle[j] = kept * memory->bristle[j] + (1 - kept) * sign;
    }
    return memory->bristle[j];
}

/* Means over the samples' own intervals of what is known on a grid `finer` times as fine. */
static inline void into_sample(size_t fine, size_t finer, size_t count, real x, real *mean)
{
    const size_t half = finer / 2, k = (fine + half) / finer;
    const size_t own = k == 0 ? finer - half : (k + 1 == count ? half + 1 : finer);
    if (k < count)
        mean[k] += x / (real)own;
}

static inline real between(const real *x, size_t stride, size_t fine, size_t finer, size_t count)
{
    const size_t k = fine / finer;
    const real share = (real)(fine % finer) / (real)finer;
    return k + 1 < count ? x[k * stride] + share * (x[(k + 1) * stride] - x[k * stride])
                         : x[(count - 1) * stride];
}

/* Play of a gear: where the load changes its side the link flies across the gap, free of torque,
 * and strikes the other flank. */
static inline void backlash(
    size_t count, real step, const real *q, const real *v, const real *a, const real *load, int j,
    real gap, real share, real coarsest, real *torque, real *spare)
{
    real *lost = spare, *behind = spare + count, *inertia = spare + 2 * count, column[N], slope[N];
    if (count < 3)
        return;
    const size_t finer = (size_t)fmax(1, ceil(step / coarsest)), whole = (count - 1) * finer + 1;
    const real fine_step = step / (real)finer;
    for (size_t k = 0; k < count; ++k) {
        slopes(q + k * N, v + k * N, a + k * N, j, 0, 0, 1, column);
        inertia[k] = fmax(column[j], R(1e-12));
        lost[k] = behind[k] = 0;
    }
#define LOAD(i) between(load + j, N, i, finer, count)
#define PULL(i) (LOAD(i) / between(inertia, 1, i, finer, count))
    for (size_t i = 0; i < whole;) {
        const real own = LOAD(i);
        const int starts = i > 0 && (PULL(i) < 0) != (PULL(i - 1) < 0);
        if (!starts) {
            into_sample(i, finer, count, R(0.5) * gap * (real)((own > 0) - (own < 0)), behind);
            i += 1;
            continue;
        }
        const real side = PULL(i) < 0 ? -1 : 1;
        real speed = 0, way = 0, blow = 0;
        size_t end = i;
        int met = 0;
        while (end < whole && !met) {
            speed += side * PULL(end);
            way += speed;
            met = way * (fine_step * fine_step) < 0 || way * (fine_step * fine_step) >= gap;
            end += 1;
        }
        if (end >= whole)
            met = 0;
        const size_t last = met ? end : whole;
        for (size_t k = i; k < last; ++k) {
            blow += LOAD(k);
            into_sample(k, finer, count, -LOAD(k), lost);
        }
        /* At the flank it is struck, and a change of side there is no start of another flight. */
        if (last < whole) {
            const real there = LOAD(last);
            into_sample(last, finer, count, blow, lost);
            into_sample(
                last, finer, count, R(0.5) * gap * (real)((there > 0) - (there < 0)), behind);
        }
        i = last + 1;
    }
    for (size_t k = 0; k < count; ++k) {
        slopes(q + k * N, v + k * N, a + k * N, j, 0, 0, 1, column);
        slopes(q + k * N, v + k * N, a + k * N, j, 1, 0, 0, slope);
        for (int r = 0; r < N; ++r)
            torque[k * N + r] += share * (column[r] / inertia[k] * lost[k] - slope[r] * behind[k]);
    }
#undef LOAD
#undef PULL
}

/* Friction in all its forms but those with a memory, and those that follow time or a column. */
static void add_friction(
    real start, const real *s, const real *q, const real *v, const real *load, real *tau)
{
    (void)start, (void)s, (void)q, (void)v, (void)load, (void)tau;
@FRICTION@
}

/* One instant: torque of the robot in `torque`, and with defects of the measurement in `tau`. */
static void robot_torque(
    excite_memory *memory, const real *q, const real *v, const real *a, const real *column,
    const real *load, const real *load_rate, const real *load_bend, real *tau)
{
    const real t = memory->t, start = memory->start;
    real s[N];
    for (int j = 0; j < N; ++j)
        s[j] = SIGN(v[j]);
    memcpy(tau, load, N * sizeof(real));
    (void)t, (void)start, (void)s, (void)a, (void)q, (void)column, (void)load_rate, (void)load_bend;
    (void)slopes, (void)tilted, (void)pushed, (void)dahl, (void)backlash;
    add_friction(start, s, q, v, load, tau);
@ROBOT_EFFECTS@
}

static void measured_torque(
    const real *q, const real *v, const real *column, const real *load, const real *torque,
    const real *torque_rate, real *tau)
{
    memmove(tau, torque, N * sizeof(real));
    (void)q, (void)v, (void)column, (void)load, (void)torque_rate;
@DEFECTS@
}

static int given(const real *q, const real *v, const real *a, const real *column)
{
    return all_finite(N, q) && all_finite(N, v) && all_finite(N, a)
        && (!column || all_finite(EXCITE_COLUMNS, column));
}

static int answer(size_t count, int sound, real *x) /* 1 and NaN, unless all is finite */
{
    sound = sound && all_finite(count, x);
    if (!sound)
        spoil(count, x, 0);
    return !sound;
}

int excite_load(const real q[N], const real v[N], const real a[N], real tau[N])
{
    rigid(LOADED, GRAVITY, q, v, a, tau);
    return answer(N, given(q, v, a, 0), tau);
}

/* `load`: torque that the gears carry. */
int excite_friction(const real q[N], const real v[N], const real load[N], real tau[N])
{
    real s[N];
    for (int j = 0; j < N; ++j)
        s[j] = SIGN(v[j]);
    memset(tau, 0, N * sizeof(real));
    add_friction(0, s, q, v, load, tau);
    return answer(N, given(q, v, load, 0), tau);
}

/* `step` between the instants [s]; `start` on the campaign's clock [s]. */
int excite_begin(excite_memory *memory, real step, real start)
{
    memset(memory, 0, sizeof(*memory));
    memory->usable = all_finite(1, &step) && all_finite(1, &start) && step > 0;
    memory->step = memory->usable ? step : 1;
    memory->start = memory->usable ? start : 0;
    return !memory->usable;
}

static void next(excite_memory *memory, const real *q, const real *v)
{
    memcpy(memory->last_q, memory->q, sizeof(memory->q));
    memcpy(memory->last_v, memory->v, sizeof(memory->v));
    memcpy(memory->q, q, sizeof(memory->q));
    memcpy(memory->v, v, sizeof(memory->v));
    memory->t = (real)memory->count * memory->step;
    memory->before = memory->since;
    memory->since = (real)(memory->count - memory->last) * memory->step;
}

/* After an instant: what was computed `ahead` becomes the memory if it is finite. Else the memory
 * stays as it was, only that differences begin anew: one of its own numbers may be too large. */
static int kept(excite_memory *memory, excite_memory *ahead, int sound)
{
    if (sound && all_finite(N, ahead->bristle)) {
        ahead->last = ahead->count;
        ahead->known += 1;
        ahead->rated += 1;
        *memory = *ahead;
    } else {
        sound = 0;
        memory->rated = 0;
    }
    memory->count += 1;
    return sound;
}

/* First and second backward difference; `last` are the one and the two before. */
static inline void backward(
    const excite_memory *memory, const real *now, real last[2][N], real *rate, real *bend)
{
    const real since = memory->since, before = memory->before;
    for (int j = 0; j < N; ++j) {
        rate[j] = memory->rated > 0 ? (now[j] - last[0][j]) / since : 0;
        bend[j] = memory->rated > 1
            ? 2 * (rate[j] - (last[0][j] - last[1][j]) / before) / (since + before) : 0;
        rate[j] += R(0.5) * since * bend[j];
        last[1][j] = last[0][j];
        last[0][j] = now[j];
    }
}

int excite_torque(
    excite_memory *memory, const real q[N], const real v[N], const real a[N],
    const real column[], real tau[N])
{
    real load[N], torque[N], rate[N] = {0}, bend[N] = {0};
    excite_memory ahead = *memory;
    if (!memory->usable || !given(q, v, a, column)) {
        memory->count += 1;
        return answer(N, 0, tau);
    }
    next(&ahead, q, v);
    rigid(LOADED, GRAVITY, q, v, a, load);
    if (RATES)
        backward(&ahead, load, ahead.load, rate, bend);
    robot_torque(&ahead, q, v, a, column, load, rate, bend, torque);
    if (RATES)
        backward(&ahead, torque, ahead.torque, rate, bend);
    for (int j = 0; j < N; ++j)
        if (!signbit(v[j]) != !signbit(ahead.last_v[j])) /* a jump has no rate */
            rate[j] = 0;
    measured_torque(q, v, column, load, torque, rate, tau);
    const int sound = all_finite(N, load) && all_finite(N, torque) && all_finite(N, tau);
    return answer(N, kept(memory, &ahead, sound), tau);
}

int excite_state(const real q[N], const real v[N], const real a[N]@COLUMN@, real tau[N])
{
    excite_memory memory;
    excite_begin(&memory, 1, 0);
    return excite_torque(&memory, q, v, a, @COLUMN_GIVEN@, tau);
}

/* Central differences of rows; one-sided at the ends. */
static void rates(size_t count, real step, const real *x, real *out)
{
    for (size_t k = 0; k < count; ++k) {
        const size_t before = k ? k - 1 : 0, after = k + 1 < count ? k + 1 : k;
        for (int j = 0; j < N; ++j)
            out[k * N + j] = count < 3 ? 0
                : (x[after * N + j] - x[before * N + j]) / ((real)(after - before) * step);
    }
}

static int turns_back(size_t count, const real *v, size_t k, int j)
{
    const int ahead = !signbit(v[k * N + j]);
    return (k && ahead != !signbit(v[(k - 1) * N + j]))
        || (k + 1 < count && ahead != !signbit(v[(k + 1) * N + j]));
}

/* Dry friction jumps where a joint turns back. A jump has no rate: there, a line from one instant
 * without to the next. */
static void no_jumps(size_t count, const real *v, real *rate)
{
    for (int j = 0; j < N; ++j)
        for (size_t k = 0; k < count; ++k) {
            const size_t first = k;
            while (k < count && turns_back(count, v, k, j))
                ++k;
            const real before = first ? rate[(first - 1) * N + j] : 0;
            const real after = k < count ? rate[k * N + j] : before;
            for (size_t i = first; i < k; ++i) {
                const real u = (real)(i + 1 - first) / (real)(k + 1 - first);
                rate[i * N + j] = first ? (1 - u) * before + u * after : after;
            }
        }
}

/* Numbers that excite_series needs to work with. */
size_t excite_work(size_t count)
{
    return (4 * N + 3) * count;
}

/* A part of a recording in which all is finite; `load` is known. */
static void part(
    excite_memory *memory, size_t count, const real *q, const real *v, const real *a,
    const real *column, real *tau, const real *load, real *rate, real *bend, real *torque, real *spare)
{
    const real step = memory->step;
    if (RATES) {
        rates(count, step, load, rate);
        rates(count, step, rate, bend);
    }
    for (size_t k = 0; k < count; ++k) {
        excite_memory ahead = *memory;
        next(&ahead, q + k * N, v + k * N);
        robot_torque(
            &ahead, q + k * N, v + k * N, a + k * N, column ? column + k * EXCITE_COLUMNS : 0,
            load + k * N, RATES ? rate + k * N : STILL, RATES ? bend + k * N : STILL, torque + k * N);
        kept(memory, &ahead, all_finite(N, torque + k * N));
    }
    (void)spare;
@SERIES_EFFECTS@
    if (RATES) {
        rates(count, step, torque, rate);
        no_jumps(count, v, rate);
    }
    for (size_t k = 0; k < count; ++k)
        measured_torque(
            q + k * N, v + k * N, column ? column + k * EXCITE_COLUMNS : 0, load + k * N,
            torque + k * N, RATES ? rate + k * N : STILL, tau + k * N);
}

size_t excite_series(
    size_t count, real step, real start, const real *q, const real *v, const real *a,
    const real *column, real *tau, real *work)
{
    real *load = work, *rate = work + N * count, *bend = work + 2 * N * count;
    real *torque = work + 3 * N * count, *spare = work + 4 * N * count;
    size_t bad = 0;
    excite_memory memory;
    excite_begin(&memory, step, start);
    for (size_t k = 0; k < count;) {
        size_t end = k;
        for (; memory.usable && end < count; ++end) {
            const real *columns = column ? column + end * EXCITE_COLUMNS : 0;
            if (!given(q + end * N, v + end * N, a + end * N, columns)
                || excite_load(q + end * N, v + end * N, a + end * N, load + end * N))
                break;
        }
        if (end > k)
            part(
                &memory, end - k, q + k * N, v + k * N, a + k * N,
                column ? column + k * EXCITE_COLUMNS : 0, tau + k * N, load + k * N, rate + k * N,
                bend + k * N, torque + k * N, spare);
        if (end < count) {
            spoil(N, tau + end * N, 0);
            memory.count += 1;
            end += 1;
        }
        k = end;
    }
    for (size_t k = 0; k < count; ++k)
        if (!all_finite(N, tau + k * N)) {
            spoil(N, tau + k * N, 0);
            bad += 1;
        }
    return bad;
}

#define TESTED @TESTED@
static const real TEST_Q[TESTED * N] = {@TEST_Q@};
static const real TEST_V[TESTED * N] = {@TEST_V@};
static const real TEST_A[TESTED * N] = {@TEST_A@};
static const real TEST_TAU[TESTED * N] = {@TEST_TAU@};
static const real TEST_COLUMN[TESTED * EXCITE_COLUMNS + 1] = {@TEST_COLUMN@};

/* Whether every number of an instant may be NaN or infinite without anything left of it. */
static int recovers(void)
{
    enum { GIVEN = 3 * N + EXCITE_COLUMNS };
    for (int k = 0; k < 2 * GIVEN; ++k) {
        real x[GIVEN + 1], tau[N];
        excite_memory memory;
        excite_begin(&memory, R(@TEST_STEP@), 0);
        for (size_t at = 0; at < TESTED; ++at) {
            memcpy(x, TEST_Q + at * N, N * sizeof(real));
            memcpy(x + N, TEST_V + at * N, N * sizeof(real));
            memcpy(x + 2 * N, TEST_A + at * N, N * sizeof(real));
            memcpy(x + 3 * N, TEST_COLUMN + at * EXCITE_COLUMNS, EXCITE_COLUMNS * sizeof(real));
            if (at == TESTED / 2)
                spoil(1, x + k / 2, k % 2);
            const int bad = excite_torque(&memory, x, x + N, x + 2 * N, x + 3 * N, tau);
            if (bad != (at == TESTED / 2) || bad == all_finite(N, tau))
                return 0;
        }
    }
    return 1;
}

/* Relative to the largest of `count` recorded numbers; 1 if one of `found` is not finite. */
static real deviation(size_t count, const real *found, const real *recorded)
{
    real worst = 0, largest = 0;
    if (!all_finite(count, found))
        return 1;
    for (size_t i = 0; i < count; ++i) {
        worst = fmax(worst, fabs(found[i] - recorded[i]));
        largest = fmax(largest, fabs(recorded[i]));
    }
    return largest > 0 ? worst / largest : worst;
}

real excite_self_test(void)
{
    real tau[TESTED * N], work[(4 * N + 3) * TESTED];
    excite_series(TESTED, R(@TEST_STEP@), 0, TEST_Q, TEST_V, TEST_A, TEST_COLUMN, tau, work);
    return recovers() ? deviation(TESTED * N, tau, TEST_TAU) : 1;
}

@DETECTOR@
@STD@
#ifdef EXCITE_MAIN
#include <stdio.h>
#include <time.h>
#ifndef EXCITE_CALLS
#define EXCITE_CALLS 200000
#endif
int main(void)
{
    real worst = excite_self_test();
#ifdef EXCITE_DETECTOR
    worst = fmax(worst, excite_detector_self_test());
#endif
#ifdef EXCITE_STD
    worst = fmax(worst, excite_std_self_test());
#endif
    const long calls = EXCITE_CALLS;
    excite_memory memory;
    real tau[N], sum = 0;
    excite_begin(&memory, R(@TEST_STEP@), 0);
    const clock_t began = clock();
    for (long k = 0; k < calls; ++k) {
        const size_t at = (size_t)k % TESTED;
        excite_torque(
            &memory, TEST_Q + at * N, TEST_V + at * N, TEST_A + at * N,
            TEST_COLUMN + at * EXCITE_COLUMNS, tau);
        sum += tau[0];
    }
    const double seconds = (double)(clock() - began) / CLOCKS_PER_SEC;
    printf("deviation %.2g of the largest torque; %.3f us per call (%g)\n", (double)worst,
        1e6 * seconds / (double)calls, (double)sum);
#ifdef EXCITE_STD
    const clock_t again = clock();
    for (long k = 0; k < calls / 10; ++k) {
        const size_t at = (size_t)k % TESTED;
        excite_std(TEST_Q + at * N, TEST_V + at * N, TEST_A + at * N@STD_COLUMN@, tau);
        sum += tau[0];
    }
    const double longer = (double)(clock() - again) / CLOCKS_PER_SEC;
    printf("standard deviation: %.3f us per call (%g)\n", 1e7 * longer / (double)calls, (double)sum);
#endif
    return worst <= (sizeof(real) == sizeof(float) ? R(1e-3) : R(1e-9)) ? 0 : 1;
}
#endif
