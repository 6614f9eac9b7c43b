/* A collision detector, made for @FALSE_ALARMS@ false alarms an hour on all joints together. */
#define EXCITE_DETECTOR

typedef struct {
    real share;              /* of a new residual in the filtered one */
    real filtered[N];
    int begun;
} excite_detector;

/* c0 to c3 of the squared size of sound residuals (1, v^2, load^2, standing), and the level. */
static const real SOUND[N][5] = {
@SOUND@
};

/* `step` between the instants [s]. */
void excite_detector_begin(excite_detector *detector, real step)
{
    memset(detector, 0, sizeof(*detector));
    detector->share = 1 - exp(-step / @TIME_CONSTANT@);
}

/* Whether the next `residual` (measured torque less excite_torque) says collision on some joint.
 * `load` is that of excite_load; `beyond` gets every filtered residual over its threshold, whose
 * sign tells from which side. */
int excite_detect(
    excite_detector *detector, const real residual[N], const real v[N], const real load[N],
    real beyond[N])
{
    int found = 0;
    for (int j = 0; j < N; ++j) {
        const real slow = v[j] / @REVERSAL@, *c = SOUND[j];
        const real size = c[4] * sqrt(
            c[0] + c[1] * v[j] * v[j] + c[2] * load[j] * load[j] + c[3] * exp(-slow * slow));
        const real share = detector->begun ? detector->share : 1;
        detector->filtered[j] += share * (residual[j] - detector->filtered[j]);
        beyond[j] = detector->filtered[j] / size;
        found |= fabs(beyond[j]) > 1;
    }
    detector->begun = 1;
    return found;
}

static const real DETECTED[TESTED * N] = {@DETECTED@};

/* Largest deviation from recorded answers, relative to the largest of them. */
real excite_detector_self_test(void)
{
    excite_detector detector;
    real residual[N], v[N], load[N], beyond[N], worst = 0, largest = 0;
    excite_detector_begin(&detector, R(@TEST_STEP@));
    for (int k = 0; k < TESTED; ++k) {
        for (int j = 0; j < N; ++j) {
            residual[j] = sin(R(0.7) * (real)k + (real)j);
            v[j] = R(0.2) * cos(R(0.3) * (real)k + 2 * (real)j);
            load[j] = 10 * sin(R(0.11) * (real)k + (real)j);
        }
        excite_detect(&detector, residual, v, load, beyond);
        for (int j = 0; j < N; ++j) {
            worst = fmax(worst, fabs(beyond[j] - DETECTED[k * N + j]));
            largest = fmax(largest, fabs(beyond[j]));
        }
    }
    return worst / largest;
}
