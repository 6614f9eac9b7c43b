/* The standard deviation s of a measured torque about that of excite_state, in a state by itself.
 * Where a joint moves (|v| > MOVING)
 *
 *     s^2 = L + CURVE (tau - load - line)^2 + d^2,    L = (c0 + c1 v^2 + c2 load^2 + c3 r^2) g^2,
 *     r = (SMEAR a)^2 / ((SMEAR a)^2 + v^2),    g = max(1, |v|/v99, |load|/load99),
 *     line = fv v + fc sgn v + i a + t0 + k q + m load
 *
 * with v and load within v99 and load99 in the bracket; where it stands s^2 = max(L, rest) + fc^2/3
 * + d^2. All of it is of the residuals on the model's own data; d^2 = |R x|^2 by the covariance R'R
 * of its parameters, x their columns@ZERO@. */
#define EXCITE_STD

/* c0 to c3, rest, v99, load99, then fv, fc, i, t0, k, m; c0 below 0: too few samples. */
static const real OWN[N][13] = {
@OWN@
};
static const real MOVING = R(@MOVING@), SMEAR = R(@SMEAR@), CURVE = R(@CURVE@);

#define UNSURE @UNSURE@ /* parameters with a covariance */
#define INERTIAL @INERTIAL@ /* the first of them are inertial */
#if UNSURE
static const int SELECTED[INERTIAL + 1] = {@SELECTED@};
static const real ROOT[UNSURE * (UNSURE + 1) / 2] = {@ROOT@}; /* R, by columns down to the diagonal */

/* Columns of the ten parameters of every body: the power of its wrench while one joint alone moves,
 * with unit speed, which turns the body by `turn` and moves its origin by `way`. */
static void inertial_columns(const real *q, const real *v, const real *a, real x[10 * M][N])
{
    motion at;
    real all[3][M];
    spread(q, v, a, all);
    move(GRAVITY, all[0], all[1], all[2], &at);
    memset(x, 0, 10 * M * sizeof(*x));
    for (int j = 0; j < M; ++j) {
        real turn[M][3], way[M][3];
        int moved[M] = {0};
        for (int k = j; k < M; ++k) {
            const int parent = JOINT[k].parent;
            const real *w = at.w[k], *dw = at.dw[k], *acc = at.acc[k];
            real *o = turn[k], *l = way[k], y[3], z[3], h[3];
            moved[k] = k == j || (parent >= j && moved[parent]);
            if (!moved[k])
                continue;
            if (k == j) {
                memset(o, 0, sizeof(turn[k]));
                memset(l, 0, sizeof(way[k]));
                memcpy(JOINT[j].slides ? l : o, JOINT[j].axis, sizeof(turn[k]));
            } else {
                cross(turn[parent], at.p[k], y);
                for (int i = 0; i < 3; ++i)
                    y[i] += way[parent][i];
                into(at.r[k], y, l);
                into(at.r[k], turn[parent], o);
            }
            cross(l, w, y);
            cross(y, w, h);
            cross(l, dw, y);
            cross(acc, o, z);
            for (int i = 0; i < 3; ++i)
                h[i] += y[i] + z[i];
            cross(o, w, y);
            const real ten[10] = {
                l[0] * acc[0] + l[1] * acc[1] + l[2] * acc[2], h[0], h[1], h[2],
                o[0] * dw[0] + y[0] * w[0], o[0] * dw[1] + o[1] * dw[0] + y[0] * w[1] + y[1] * w[0],
                o[1] * dw[1] + y[1] * w[1], o[0] * dw[2] + o[2] * dw[0] + y[0] * w[2] + y[2] * w[0],
                o[1] * dw[2] + o[2] * dw[1] + y[1] * w[2] + y[2] * w[1], o[2] * dw[2] + y[2] * w[2],
            };
            for (int i = 0; i < 10; ++i)
                x[10 * k + i][JOINT[j].driver] += JOINT[j].multiplier * ten[i];
        }
    }
}

/* Adds d^2. Effects add to the torque what one unit of each of their parameters does. */
static void add_parameters(const real *q, const real *v, const real *a, real square[N])
{
    const real t = 0, start = 0, *column = 0, *torque_rate = STILL;
    const real *load_rate = STILL, *load_bend = STILL;
    real x[UNSURE][N] = {{0}}, ten[10 * M][N], s[N], load[N], torque[N];
    excite_memory fresh, *memory = &fresh;
    excite_begin(memory, 1, 0);
    next(memory, q, v);
    for (int j = 0; j < N; ++j)
        s[j] = SIGN(v[j]);
    rigid(LOADED, GRAVITY, q, v, a, load);
    if (@WHOLE@)
        robot_torque(memory, q, v, a, column, load, load_rate, load_bend, torque);
    (void)t, (void)start, (void)column, (void)torque_rate, (void)load_rate, (void)load_bend;
    (void)s, (void)torque;
@EFFECT_COLUMNS@
    inertial_columns(q, v, a, ten);
    for (int i = 0; i < INERTIAL; ++i)
        memcpy(x[i], ten[SELECTED[i]], sizeof(*x));
    for (int j = 0; j < N; ++j) {
        const real *own = ROOT;
        real y[UNSURE] = {0};
        for (int k = 0; k < UNSURE; own += ++k)
            if (x[k][j] != 0)
                for (int i = 0; i <= k; ++i)
                    y[i] += x[k][j] * own[i];
        for (int i = 0; i < UNSURE; ++i)
            square[j] += y[i] * y[i];
    }
}
#endif

/* 1 where some s is not known, which is NaN: of joints with too few samples, and of all where
 * something given is not finite. */
int excite_std(const real q[N], const real v[N], const real a[N]@COLUMN@, real s[N])
{
    int sound = given(q, v, a, 0), unknown = 0;
    real load[N], tau[N];
    rigid(BODY, GRAVITY, q, v, a, load);
    sound &= !excite_state(q, v, a@GIVEN@, tau);
    for (int j = 0; j < N; ++j) {
        const real *c = OWN[j], *line = c + 7, fast = fabs(v[j]), heavy = fabs(load[j]);
        const real g = fmax(1, fmax(fast / c[5], heavy / c[6])), way = SMEAR * SMEAR * a[j] * a[j];
        const real r = way > 0 ? way / (way + fast * fast) : 0;
        const real inside = fmin(fast, c[5]), carried = fmin(heavy, c[6]);
        const real left = g * g
            * (c[0] + c[1] * inside * inside + c[2] * carried * carried + c[3] * r * r);
        const real curve = tau[j] - load[j] - line[0] * v[j]
            - line[1] * (real)((v[j] > 0) - (v[j] < 0)) - line[2] * a[j] - line[3]
            - line[4] * q[j] - line[5] * load[j];
        s[j] = fast > MOVING ? left + CURVE * curve * curve
                             : fmax(left, c[4]) + line[1] * line[1] / 3;
    }
#if UNSURE
    add_parameters(q, v, a, s);
#endif
    for (int j = 0; j < N; ++j) {
        s[j] = sqrt(s[j]);
        unknown |= answer(1, sound && OWN[j][0] >= 0, s + j);
    }
    return unknown;
}

static const real TEST_STD[TESTED * N] = {@TEST_STD@}; /* 0 where it is not known */

/* Largest deviation from recorded s, relative to the largest of them; 1 if one is given for a state
 * that is not finite. */
real excite_std_self_test(void)
{
    real found[TESTED * N], x[3 * N], s[N];
    for (size_t k = 0; k < TESTED; ++k) {
        const size_t at = k;
        (void)at;
        excite_std(TEST_Q + k * N, TEST_V + k * N, TEST_A + k * N@TEST_COLUMN@, found + k * N);
        for (int j = 0; j < N; ++j)
            if (OWN[j][0] < 0 && !all_finite(1, found + k * N + j))
                found[k * N + j] = 0;
    }
    for (int k = 0; k < 6 * N; ++k) {
        memset(x, 0, sizeof(x));
        spoil(1, x + k / 2, k % 2);
        if (!excite_std(x, x + N, x + 2 * N@TEST_ROW@, s) || all_finite(1, s))
            return 1;
    }
    return deviation(TESTED * N, found, TEST_STD);
}

