/* Constants of the central difference sigma points (Norgaard, Poulsen, Ravn 2000; van der Merwe 2004, algorithm 3.4).
 *
 * For a mean x with factor S the points are x and x +- h S_j, column by column. With D(+-) the increments that the model
 * gives at a pair and D(0) that at the mean, and h^2 = 3 (the kurtosis of a Gaussian):
 *   mean of the increment    D(0) + sum_j (D(+) + D(-) - 2 D(0)) / (2 h^2)
 *   columns, first order     c1 (D(+) - D(-)),            c1 = 1 / (2 h)
 *   columns, second order    c2 (D(+) + D(-) - 2 D(0)),   c2 = sqrt(h^2 - 1) / (2 h^2)
 * The mean is the usual weighted one, m0 = (h^2 - L) / h^2 and m = 1 / (2 h^2), written so that it needs no L.
 */
#ifndef FILTER_SIGMA_POINTS_H
#define FILTER_SIGMA_POINTS_H

#define SIGMA_SPREAD 1.73205081f  /* h */
#define SIGMA_FIRST 0.288675135f  /* c1 */
#define SIGMA_SECOND 0.235702260f /* c2 */
#define SIGMA_MEAN 0.166666667f   /* 1 / (2 h^2) */

#endif
