#include "filters.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

enum { N = FILTER_Z, W = FILTER_W, X = FILTER_STATES, POINTS = FILTER_POINTS };

static const double root3 = 1.7320508075688772; /* h of the central difference filters */
static const double reach = 5.0; /* unscented: n + lambda, of alpha 1 and kappa 0; a point weighs 0.5 / reach, */
static const double centre_weight = 2.0; /* the centre 1 - alpha^2 + beta in the covariance, and 0 in the mean */
static const double skipped = 1.0e12;    /* variance of a missing output over what it is: it counts for nothing */

/* One filter; of each kind its own part of it. */
typedef struct filter {
    const filter_given_t *given;
    double w[W];
    double x[X];
    double p[N][N];            /* joint: covariance of [w; x] */
    double p_w[W][W];          /* others: of w */
    double p_x[X][X];          /* dual: of x */
    double derivative[X][W];   /* dual: dx/dw */
    double prior[W][W];        /* parameters: p_w with its walk, */
    double factor[W][W];       /* its Cholesky factor, */
    double point_w[POINTS][W]; /* and sigma points, in physical units, */
    double point_x[POINTS][X]; /* under way */
    double innovation[X];
    double s[X][X]; /* its covariance */
} filter_t;

/* --- the model --------------------------------------------------------------------------------------------------- */

/* What is the same for all points of a step. */
typedef struct inputs {
    double z_ddot;
    double tau_m;
    double trim;
    double trim_sine;
} inputs_t;

/* Sine and cosine where they were wanted last: many points share the angle. */
typedef struct angle {
    double value;
    double sine;
    double cosine;
} angle_t;

static inputs_t inputs_at(const filter_given_t *given, uint32_t k)
{
    const inputs_t inputs = {0.5 * (given->u[k][0] + given->u[k + 1u][0]), 0.5 * (given->u[k][1] + given->u[k + 1u][1]),
        given->trim[k], sin(given->model.trims ? given->trim[k] : given->model.arm_preload_angle)};
    return inputs;
}

static void step_lever(
    const filter_model_t *m, const double p[W], const inputs_t *in, double dt, angle_t *angle, double x[X])
{
    const double theta = x[0] + in->trim;
    const double rate = x[1];
    const double middle = theta + (0.5 * dt * rate);
    if (!(middle == angle->value)) {
        angle->value = middle;
        angle->sine = sin(middle);
        angle->cosine = cos(middle);
    }
    const double moment = m->own_moment + (m->length * p[0]);
    const double own = m->stiffness * (middle - (m->trims ? in->trim : m->rest));
    const double weight = m->trims ? 0.0 : (m->gravity * moment * angle->cosine);
    const double spring = (m->length * m->length * p[2] * (angle->sine - in->trim_sine) * angle->cosine) + own + weight;
    const double rise = m->length * angle->cosine;
    const double damping = (p[1] * rise * rise) + m->damping;
    const double inertia = m->own_inertia + (m->length * m->length * p[0]);
    const double force = in->tau_m - (moment * angle->cosine * in->z_ddot) - spring;
    const double change = dt * (force - (damping * rate)) / (inertia + (0.5 * dt * damping));
    x[0] = theta + (dt * (rate + (0.5 * change))) - in->trim;
    x[1] = rate + change;
}

static void step_linear(const filter_model_t *m, const double p[W], const inputs_t *in, double dt, double x[X])
{
    const bool physical = (m->kind == (uint32_t)FILTER_PHYSICAL);
    const double stiffness = physical ? (p[2] / p[0]) : -p[0];
    const double damping = physical ? (p[1] / p[0]) : -p[1];
    const double drive = physical ? (in->z_ddot + (in->tau_m / p[0])) : (p[2] * in->z_ddot);
    const double middle = x[0] + (0.5 * dt * x[1]) - (m->trims ? 0.0 : m->rest);
    const double change = dt * (drive - (stiffness * middle) - (damping * x[1])) / (1.0 + (0.5 * dt * damping));
    x[0] += dt * (x[1] + (0.5 * change));
    x[1] += change;
}

/* States at the next sample, in place; p in physical units. */
static void move(const filter_given_t *given, const double p[W], const inputs_t *in, angle_t *angle, double x[X])
{
    if (given->model.kind == (uint32_t)FILTER_LEVER) {
        step_lever(&given->model, p, in, given->period, angle, x);
    } else {
        step_linear(&given->model, p, in, given->period, x);
    }
}

/* Physical units of w. */
static double physical(const filter_given_t *given, uint32_t i, double w)
{
    return given->positive ? (given->guess[i] * exp(w)) : (given->guess[i] + (given->sigma[i] * w));
}

/* The same a difference away from where it is p. */
static double beside(const filter_given_t *given, uint32_t i, double p, double difference)
{
    return given->positive ? (p * exp(difference)) : (p + (given->sigma[i] * difference));
}

/* The step from sample k with its derivatives by x and w, by central differences; returns the states in x. */
static void slopes(filter_t *f, uint32_t k, double dx[X][X], double dw[X][W])
{
    const filter_given_t *given = f->given;
    const inputs_t in = inputs_at(given, k);
    const double half = given->difference;
    angle_t angle = {(double)NAN, 0.0, 0.0};
    double centre[W];
    for (uint32_t i = 0u; i < (uint32_t)W; i++) {
        centre[i] = physical(given, i, f->w[i]);
    }
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        double end[2][X];
        for (uint32_t side = 0u; side < 2u; side++) {
            const double difference = (side == 0u) ? half : -half;
            double p[W] = {centre[0], centre[1], centre[2]};
            end[side][0] = f->x[0] + ((i == 3u) ? difference : 0.0);
            end[side][1] = f->x[1] + ((i == 4u) ? difference : 0.0);
            if (i < (uint32_t)W) {
                p[i] = beside(given, i, centre[i], difference);
            }
            move(given, p, &in, &angle, end[side]);
        }
        for (uint32_t row = 0u; row < (uint32_t)X; row++) {
            const double slope = (end[0][row] - end[1][row]) / (2.0 * half);
            if (i < (uint32_t)W) {
                dw[row][i] = slope;
            } else {
                dx[row][i - (uint32_t)W] = slope;
            }
        }
    }
    move(given, centre, &in, &angle, f->x);
}

/* --- small matrices ---------------------------------------------------------------------------------------------- */

static void invert(double a[X][X], double inverse[X][X])
{
    const double determinant = (a[0][0] * a[1][1]) - (a[0][1] * a[1][0]);
    inverse[0][0] = a[1][1] / determinant;
    inverse[0][1] = -a[0][1] / determinant;
    inverse[1][0] = -a[1][0] / determinant;
    inverse[1][1] = a[0][0] / determinant;
}

/* Lower-triangular factor of a (n by n, in rows of n); NaN where it is not positive definite. */
static void cholesky(uint32_t n, const double *a, double *factor)
{
    (void)memset(factor, 0, (size_t)n * n * sizeof factor[0]);
    for (uint32_t i = 0u; i < n; i++) {
        for (uint32_t j = 0u; j <= i; j++) {
            double sum = a[(i * n) + j];
            for (uint32_t k = 0u; k < j; k++) {
                sum -= factor[(i * n) + k] * factor[(j * n) + k];
            }
            factor[(i * n) + j] = (i == j) ? sqrt(sum) : (sum / factor[(j * n) + j]);
        }
    }
}

/* The correction of n values by the innovation, K = cross S^-1, and of their covariance, P - K S K^T (rows of n). */
static void correct(filter_t *f, uint32_t n, double cross[][X], double *value, double *p)
{
    double inverse[X][X];
    double gain[N][X];
    invert(f->s, inverse);
    for (uint32_t i = 0u; i < n; i++) {
        gain[i][0] = (cross[i][0] * inverse[0][0]) + (cross[i][1] * inverse[1][0]);
        gain[i][1] = (cross[i][0] * inverse[0][1]) + (cross[i][1] * inverse[1][1]);
        value[i] += (gain[i][0] * f->innovation[0]) + (gain[i][1] * f->innovation[1]);
    }
    for (uint32_t i = 0u; i < n; i++) {
        for (uint32_t j = 0u; j < n; j++) {
            p[(i * n) + j] -= (gain[i][0] * cross[j][0]) + (gain[i][1] * cross[j][1]);
        }
    }
}

static void innovate(filter_t *f, const double y[X], const double predicted[X])
{
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        f->innovation[i] = y[i] - predicted[i];
    }
}

static double squared(double x)
{
    return x * x;
}

static double walk(const filter_given_t *given, uint32_t i)
{
    return squared(given->walk_w[i]) * given->period;
}

/* --- joint ------------------------------------------------------------------------------------------------------- */

/* T P T^T with T = [1, 0; dw, dx]. */
static void predict_ekf(filter_t *f, uint32_t k)
{
    double dx[X][X];
    double dw[X][W];
    slopes(f, k, dx, dw);
    for (uint32_t pass = 0u; pass < 2u; pass++) { /* T P, and the same of its transpose */
        double result[N][N];
        for (uint32_t j = 0u; j < (uint32_t)N; j++) {
            for (uint32_t i = 0u; i < (uint32_t)N; i++) {
                double sum = f->p[i][j];
                if (i >= (uint32_t)W) {
                    const uint32_t row = i - (uint32_t)W;
                    sum = (dx[row][0] * f->p[3][j]) + (dx[row][1] * f->p[4][j]);
                    sum += (dw[row][0] * f->p[0][j]) + (dw[row][1] * f->p[1][j]) + (dw[row][2] * f->p[2][j]);
                }
                result[j][i] = sum;
            }
        }
        (void)memcpy(f->p, result, sizeof f->p);
    }
}

/* Sigma point 0 is the centre; then one for each column of the factor, and the same on the other side. */
static uint32_t column_of(uint32_t point)
{
    return (point == 0u) ? 0u : ((point - 1u) % (uint32_t)N);
}

static double side_of(uint32_t point)
{
    double side = 0.0;
    if (point > 0u) {
        side = (point <= (uint32_t)N) ? 1.0 : -1.0;
    }
    return side;
}

/* P of deviations from the mean, of which those of the states still are values with the mean `predicted`. */
static void gather(filter_t *f, double deviation[POINTS][N], const double predicted[X])
{
    const double weight = 0.5 / reach;
    for (uint32_t point = 0u; point < (uint32_t)POINTS; point++) {
        deviation[point][3] -= predicted[0];
        deviation[point][4] -= predicted[1];
    }
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        for (uint32_t j = 0u; j < (uint32_t)N; j++) {
            double sum = centre_weight * deviation[0][i] * deviation[0][j];
            for (uint32_t point = 1u; point < (uint32_t)POINTS; point++) {
                sum += weight * deviation[point][i] * deviation[point][j];
            }
            f->p[i][j] = sum;
        }
    }
}

/* Sigma points in the columns of the Cholesky factor. */
static void predict_ukf(filter_t *f, uint32_t k)
{
    const filter_given_t *given = f->given;
    const inputs_t in = inputs_at(given, k);
    const double root = sqrt(reach);
    const double weight = 0.5 / reach;
    angle_t angle = {(double)NAN, 0.0, 0.0};
    double factor[N][N];
    double deviation[POINTS][N];
    double predicted[X] = {0.0, 0.0};
    double centre[W];
    cholesky((uint32_t)N, &f->p[0][0], &factor[0][0]);
    for (uint32_t i = 0u; i < (uint32_t)W; i++) {
        centre[i] = physical(given, i, f->w[i]);
    }
    for (uint32_t point = 0u; point < (uint32_t)POINTS; point++) {
        const uint32_t column = column_of(point);
        const double sign = side_of(point) * root;
        double p[W];
        double x[X];
        for (uint32_t i = 0u; i < (uint32_t)W; i++) {
            const double offset = sign * factor[i][column];
            deviation[point][i] = offset;
            p[i] = (offset == 0.0) ? centre[i] : physical(given, i, f->w[i] + offset);
        }
        for (uint32_t i = 0u; i < (uint32_t)X; i++) {
            x[i] = f->x[i] + (sign * factor[(uint32_t)W + i][column]);
        }
        move(given, p, &in, &angle, x);
        for (uint32_t i = 0u; i < (uint32_t)X; i++) {
            deviation[point][(uint32_t)W + i] = x[i];
            predicted[i] += (point == 0u) ? 0.0 : (weight * x[i]);
        }
    }
    gather(f, deviation, predicted);
    (void)memcpy(f->x, predicted, sizeof f->x);
}

static void step_joint(filter_t *f, uint32_t k)
{
    const filter_given_t *given = f->given;
    if (given->kind == (uint32_t)FILTER_JOINT_EKF) {
        predict_ekf(f, k - 1u);
    } else {
        predict_ukf(f, k - 1u);
    }
    double z[N] = {f->w[0], f->w[1], f->w[2], f->x[0], f->x[1]};
    double cross[N][X];
    for (uint32_t i = 0u; i < (uint32_t)W; i++) {
        f->p[i][i] += walk(given, i);
    }
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        for (uint32_t j = 0u; j < (uint32_t)X; j++) {
            f->p[(uint32_t)W + i][(uint32_t)W + j] += given->process[i][j];
            f->s[i][j] = f->p[(uint32_t)W + i][(uint32_t)W + j];
        }
    }
    innovate(f, given->y[k], f->x);
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        const bool is_missing = (given->missing != NULL) && (given->missing[k][i] != 0u);
        f->innovation[i] = is_missing ? 0.0 : f->innovation[i];
        f->s[i][i] += squared(given->output_noise[i]) * (is_missing ? skipped : 1.0);
    }
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        cross[i][0] = f->p[i][3];
        cross[i][1] = f->p[i][4];
    }
    correct(f, (uint32_t)N, cross, z, &f->p[0][0]);
    (void)memcpy(f->w, z, sizeof f->w);
    (void)memcpy(f->x, &z[W], sizeof f->x);
}

/* --- dual -------------------------------------------------------------------------------------------------------- */

static void correct_parameters(filter_t *f, double derivative[X][W], double own[X][X])
{
    double cross[W][X];
    for (uint32_t i = 0u; i < (uint32_t)W; i++) {
        f->p_w[i][i] += walk(f->given, i);
    }
    for (uint32_t i = 0u; i < (uint32_t)W; i++) {
        for (uint32_t j = 0u; j < (uint32_t)X; j++) {
            cross[i][j] = (f->p_w[i][0] * derivative[j][0]) + (f->p_w[i][1] * derivative[j][1]) +
                          (f->p_w[i][2] * derivative[j][2]);
        }
    }
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        for (uint32_t j = 0u; j < (uint32_t)X; j++) {
            f->s[i][j] = own[i][j] + (derivative[i][0] * cross[0][j]) + (derivative[i][1] * cross[1][j]) +
                         (derivative[i][2] * cross[2][j]);
        }
    }
    correct(f, (uint32_t)W, cross, f->w, &f->p_w[0][0]);
}

static void step_dual(filter_t *f, uint32_t k)
{
    const filter_given_t *given = f->given;
    double dx[X][X];
    double dw[X][W];
    double derivative[X][W];
    double moved[X][X];
    double inverse[X][X];
    slopes(f, k - 1u, dx, dw);
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        for (uint32_t j = 0u; j < (uint32_t)W; j++) {
            derivative[i][j] = (dx[i][0] * f->derivative[0][j]) + (dx[i][1] * f->derivative[1][j]) + dw[i][j];
        }
        for (uint32_t j = 0u; j < (uint32_t)X; j++) {
            moved[i][j] = (dx[i][0] * f->p_x[0][j]) + (dx[i][1] * f->p_x[1][j]);
        }
    }
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        for (uint32_t j = 0u; j < (uint32_t)X; j++) {
            f->p_x[i][j] = (moved[i][0] * dx[j][0]) + (moved[i][1] * dx[j][1]) + given->process[i][j];
            f->s[i][j] = f->p_x[i][j] + ((i == j) ? squared(given->output_noise[i]) : 0.0);
        }
    }
    innovate(f, given->y[k], f->x);
    invert(f->s, inverse);
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        const double gain[X] = {(f->p_x[i][0] * inverse[0][0]) + (f->p_x[i][1] * inverse[1][0]),
            (f->p_x[i][0] * inverse[0][1]) + (f->p_x[i][1] * inverse[1][1])};
        for (uint32_t j = 0u; j < (uint32_t)W; j++) {
            f->derivative[i][j] = derivative[i][j] - (gain[0] * derivative[0][j]) - (gain[1] * derivative[1][j]);
        }
    }
    double own[X][X];
    double cross[X][X];
    (void)memcpy(own, f->s, sizeof own);
    (void)memcpy(cross, f->p_x, sizeof cross);
    correct(f, (uint32_t)X, cross, f->x, &f->p_x[0][0]);
    correct_parameters(f, derivative, own);
}

/* --- parameters alone -------------------------------------------------------------------------------------------- */

/* Sigma points of the parameters and of sample k, from which the model starts. */
static void draw(filter_t *f, uint32_t k)
{
    const filter_given_t *given = f->given;
    (void)memcpy(f->prior, f->p_w, sizeof f->prior);
    for (uint32_t i = 0u; i < (uint32_t)W; i++) {
        f->prior[i][i] += (double)given->steps * walk(given, i);
    }
    cholesky((uint32_t)W, &f->prior[0][0], &f->factor[0][0]);
    for (uint32_t point = 0u; point < (uint32_t)POINTS; point++) {
        const uint32_t column = column_of(point);
        const double sign = side_of(point) * root3;
        for (uint32_t i = 0u; i < (uint32_t)W; i++) {
            const double offset = (column < (uint32_t)W) ? (sign * f->factor[i][column]) : 0.0;
            const bool is_centre = (point > 0u) && (offset == 0.0);
            f->point_w[point][i] = is_centre ? f->point_w[0][i] : physical(given, i, f->w[i] + offset);
        }
        for (uint32_t i = 0u; i < (uint32_t)X; i++) {
            const double offset = (column == ((uint32_t)W + i)) ? (sign * given->output_noise[i]) : 0.0;
            f->point_x[point][i] = given->y[k][i] + offset;
        }
    }
}

static void update_parameters(filter_t *f, uint32_t k)
{
    const filter_given_t *given = f->given;
    double first[N][X];
    double second[N][X];
    double expected[X];
    double cross[W][X];
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        const double centre = f->point_x[0][i];
        double sum = 0.0;
        for (uint32_t j = 0u; j < (uint32_t)N; j++) {
            const double plus = f->point_x[1u + j][i];
            const double minus = f->point_x[1u + (uint32_t)N + j][i];
            sum += plus + minus;
            first[j][i] = (plus - minus) / (2.0 * root3);
            second[j][i] = sqrt(2.0) / 6.0 * (plus + minus - (2.0 * centre)); /* sqrt(h^2 - 1) / (2 h^2) */
        }
        expected[i] = (((3.0 - (double)N) * centre) + (0.5 * sum)) / 3.0;
    }
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        for (uint32_t j = 0u; j < (uint32_t)X; j++) {
            f->s[i][j] = given->process[i][j] + ((i == j) ? squared(given->output_noise[i]) : 0.0);
            for (uint32_t n = 0u; n < (uint32_t)N; n++) {
                f->s[i][j] += (first[n][i] * first[n][j]) + (second[n][i] * second[n][j]);
            }
        }
    }
    for (uint32_t i = 0u; i < (uint32_t)W; i++) {
        for (uint32_t j = 0u; j < (uint32_t)X; j++) {
            cross[i][j] =
                (f->factor[i][0] * first[0][j]) + (f->factor[i][1] * first[1][j]) + (f->factor[i][2] * first[2][j]);
        }
    }
    innovate(f, given->y[k], expected);
    (void)memcpy(f->p_w, f->prior, sizeof f->p_w);
    correct(f, (uint32_t)W, cross, f->w, &f->p_w[0][0]);
}

static void step_parameters(filter_t *f, uint32_t k)
{
    const inputs_t in = inputs_at(f->given, k - 1u);
    angle_t angle = {(double)NAN, 0.0, 0.0};
    for (uint32_t point = 0u; point < (uint32_t)POINTS; point++) {
        move(f->given, f->point_w[point], &in, &angle, f->point_x[point]);
    }
    if ((k % f->given->steps) == 0u) {
        update_parameters(f, k);
        draw(f, k);
    }
}

/* ----------------------------------------------------------------------------------------------------------------- */

static bool is_joint(const filter_t *f)
{
    return (f->given->kind == (uint32_t)FILTER_JOINT_EKF) || (f->given->kind == (uint32_t)FILTER_JOINT_UKF);
}

static void start(filter_t *f, const filter_given_t *given)
{
    (void)memset(f, 0, sizeof *f);
    f->given = given;
    for (uint32_t i = 0u; i < (uint32_t)W; i++) {
        f->p_w[i][i] = squared(given->sigma_w[i]);
        f->p[i][i] = f->p_w[i][i];
    }
    for (uint32_t i = 0u; i < (uint32_t)X; i++) {
        f->x[i] = given->y[0][i];
        f->p_x[i][i] = squared(given->output_noise[i]);
        f->p[(uint32_t)W + i][(uint32_t)W + i] = f->p_x[i][i];
        f->innovation[i] = (double)NAN;
        f->s[i][i] = 1.0;
    }
    if (given->kind == (uint32_t)FILTER_PARAMETERS) {
        draw(f, 0u);
    }
}

static void step(filter_t *f, uint32_t k)
{
    if (is_joint(f)) {
        step_joint(f, k);
    } else if (f->given->kind == (uint32_t)FILTER_DUAL_EKF) {
        step_dual(f, k);
    } else {
        step_parameters(f, k);
    }
}

static void say(filter_t *f, const filter_said_t *said, uint32_t row)
{
    double inverse[X][X];
    invert(f->s, inverse);
    const double *nu = f->innovation;
    said->nis[row] = (nu[0] * ((inverse[0][0] * nu[0]) + (inverse[0][1] * nu[1]))) +
                     (nu[1] * ((inverse[1][0] * nu[0]) + (inverse[1][1] * nu[1])));
    for (uint32_t i = 0u; i < (uint32_t)W; i++) {
        said->w[row][i] = f->w[i];
        for (uint32_t j = 0u; j < (uint32_t)W; j++) {
            said->covariance[row][i][j] = is_joint(f) ? f->p[i][j] : f->p_w[i][j];
        }
    }
}

void filter_run(const filter_given_t *given, const filter_said_t *said)
{
    filter_t filter;
    uint32_t k = 0u;
    start(&filter, given);
    for (uint32_t row = 0u; row < said->count; row++) {
        while ((int64_t)k < said->at[row]) {
            k++;
            step(&filter, k);
        }
        say(&filter, said, row);
    }
}
