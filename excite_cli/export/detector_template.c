/* A collision detector, made for @FALSE_ALARMS@ false alarms an hour on all joints together. */
#define EXCITE_DETECTOR

typedef struct {
    real share;              /* of a new residual in the filtered one */
    real filtered[N];
    int begun[N];
} excite_detector;

/* c0 to c3 of the squared size of sound residuals (1, v^2, load^2, standing), and the level. */
static const real SOUND[N][5] = {
@SOUND@
};

#define EXCITE_NOT_FINITE R(1e18) /* stands in `beyond` for what is not finite */

/* `step` between the instants [s]. With a bad one every instant is a contact until the next begin. */
int excite_detector_begin(excite_detector *detector, real step)
{
    memset(detector, 0, sizeof(*detector));
    if (all_finite(1, &step) && step > 0)
        detector->share = 1 - exp(-step / @TIME_CONSTANT@);
    return !(detector->share > 0);
}

/* Whether the next `residual` (measured torque less excite_torque) says collision on some joint.
 * `load` is that of excite_load; `beyond` gets every filtered residual over its threshold, whose
 * sign shows from which side, and EXCITE_NOT_FINITE where residual, speed or load are not finite. */
int excite_detect(
    excite_detector *detector, const real residual[N], const real v[N], const real load[N],
    real beyond[N])
{
    int found = 0;
    for (int j = 0; j < N; ++j) {
        real size = 0, share = detector->share;
        int sound = share > 0 && all_finite(1, residual + j) && all_finite(1, v + j)
            && all_finite(1, load + j);
        if (sound) {
            const real slow = v[j] / @REVERSAL@, *c = SOUND[j];
            size = c[4] * sqrt(
                c[0] + c[1] * v[j] * v[j] + c[2] * load[j] * load[j] + c[3] * exp(-slow * slow));
            sound = all_finite(1, &size) && size > 0;
        }
        if (sound) {
            if (!detector->begun[j])
                share = 1;
            detector->begun[j] = 1;
            detector->filtered[j] += share * (residual[j] - detector->filtered[j]);
            beyond[j] = detector->filtered[j] / size;
            sound = all_finite(1, beyond + j);
        }
        if (!sound)
            beyond[j] = EXCITE_NOT_FINITE;
        found |= fabs(beyond[j]) > 1;
    }
    return found;
}

static const real DETECTED[TESTED * N] = {@DETECTED@};

/* Largest deviation from recorded answers, relative to the largest of them; 1 if something that is
 * not finite is no contact. It is fed in between, and must not change any other answer. */
real excite_detector_self_test(void)
{
    excite_detector detector;
    real given[3][N], beyond[TESTED * N];
    excite_detector_begin(&detector, R(@TEST_STEP@));
    for (int k = 0; k < TESTED; ++k) {
        for (int j = 0; j < N; ++j) {
            given[0][j] = sin(R(0.7) * (real)k + (real)j);
            given[1][j] = R(0.2) * cos(R(0.3) * (real)k + 2 * (real)j);
            given[2][j] = 10 * sin(R(0.11) * (real)k + (real)j);
        }
        excite_detect(&detector, given[0], given[1], given[2], beyond + k * N);
        spoil(N, given[k % 3], k % 2);
        real spare[N];
        if (!excite_detect(&detector, given[0], given[1], given[2], spare))
            return 1;
    }
    return deviation(TESTED * N, beyond, DETECTED);
}
