/* Inner loops over instants, bodies and pairs that NumPy can only take as many passes over memory.

   Every function repeats, operation by operation, what the Python function of the same name beside
   it computes; that one is the reference of the tests, and is used where this file could not be
   compiled. Arrays are C-contiguous doubles and 64-bit integers; nothing is allocated or kept. */

#include "spatial.h"

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

/* Raised, here and in library.py, when a function takes other arguments. */
EXPORT int version(void) { return 2; }

/* setuptools asks for this name on some systems. The library is no module and is never imported: it
   needs no headers of Python, and one build serves all its versions. */
EXPORT void *PyInit__kernels(void) { return 0; }
