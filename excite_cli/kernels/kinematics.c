/* Placements and Jacobian columns of all bodies (`forward_kinematics.py`). */

#include "spatial.h"

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
