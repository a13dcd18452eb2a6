/* The likelihood by the prediction error decomposition (Schweppe 1965): the density of all samples is the product of those of
 * the innovations, each given what came before.
 *
 * Given the parameters, an innovation nu has the covariance N N^T of the state filter. The parameters are not given: by e, their
 * error in columns of S_w, with e ~ N(0, I), it is T e more. Samples from which the parameters learn together (learn_period)
 * share that e, so their density is not the product of the marginal ones. With the information L = sum T^T (N N^T)^-1 T and
 * the score s = sum T^T (N N^T)^-1 nu of such a block, what e adds to its logarithm is
 *     (s^T (I + L)^-1 s - ln |I + L|) / 2
 * (Sylvester's determinant theorem and Woodbury's identity); it is booked at the last sample of the block.
 */
#include "innovations.h"

/* The seam: filter/dual.c with other names for three functions, whose callers in app/ come to those below instead. */
#define dual_update firmware_update
#define dual_learn firmware_learn
#define dual_open firmware_open
#include "filter/dual.c"
#undef dual_update
#undef dual_learn
#undef dual_open

#include "app/link.h"
#include "lever_cdkf.h"

#include <stddef.h>

float dual_update(dual_t *dual, const measurement_t *measurement, bool learn);
bool dual_learn(dual_t *dual, float period, float caution, bool joint, float correction[MODEL_PARAMETERS],
    float learnt[MODEL_PARAMETERS]);
void dual_open(dual_t *dual);

#define PARAMETERS ((uint32_t)MODEL_PARAMETERS)
#define BOTH ((uint32_t)INNOVATION_OUTPUTS)
#define LN_TURN 1.8378770664093453 /* ln 2 pi */

/* What the samples of a block say of e; its triangle is filled below the diagonal only. */
typedef struct block {
    double information[MODEL_PARAMETERS][MODEL_PARAMETERS];
    double score[MODEL_PARAMETERS];
} block_t;

static innovation_t *current; /* of the sample that the estimator is taking; NULL: nobody asks */
static block_t block;

/* A pair of outputs: innovation, state's covariance [a b; b d] without the parameters, deviations that go with them. */
typedef struct prediction {
    double nu[INNOVATION_OUTPUTS];
    double a;
    double b;
    double d;
    double t[INNOVATION_OUTPUTS][MODEL_PARAMETERS];
    uint8_t size;
} prediction_t;

static double squared(double x)
{
    return x * x;
}

/* An output that was not measured has no innovation, and as its own unit no part in determinants. */
static prediction_t predicted(dual_t *dual, const measurement_t *measurement)
{
    const state_filter_t *state = &dual->state;
    const float *sensitivity = parameter_filter_sensitivity(&dual->parameters);
    prediction_t p;
    const bool both = measurement->valid[0] && measurement->valid[1];
    p.a = measurement->valid[0] ? (squared(state->s[0]) + squared(state->output_noise[0])) : 1.0;
    p.b = both ? ((double)state->s[0] * (double)state->s[2]) : 0.0;
    p.d = measurement->valid[1] ? (squared(state->s[2]) + squared(state->s[3]) + squared(state->output_noise[1])) : 1.0;
    p.size = 0u;
    for (uint32_t i = 0u; i < BOTH; i++) {
        const bool valid = measurement->valid[i];
        p.size = (uint8_t)(p.size + (valid ? 1u : 0u));
        p.nu[i] = valid ? ((double)measurement->y[i] - (double)state->x[i]) : 0.0;
        for (uint32_t j = 0u; j < PARAMETERS; j++) {
            p.t[i][j] = valid ? (double)sensitivity[(i * PARAMETERS) + j] : 0.0;
        }
    }
    return p;
}

/* x^T [a b; b d]^-1 y. */
static double weighted(const prediction_t *p, const double x[INNOVATION_OUTPUTS], const double y[INNOVATION_OUTPUTS])
{
    const double cross = (x[0] * y[1]) + (x[1] * y[0]);
    return ((p->d * x[0] * y[0]) - (p->b * cross) + (p->a * x[1] * y[1])) / ((p->a * p->d) - (p->b * p->b));
}

/* Adds the covariance of what the parameters' error does. */
static prediction_t marginal(const prediction_t *given)
{
    prediction_t p = *given;
    for (uint32_t j = 0u; j < PARAMETERS; j++) {
        p.a += squared(p.t[0][j]);
        p.b += p.t[0][j] * p.t[1][j];
        p.d += squared(p.t[1][j]);
    }
    return p;
}

static double log_density(const prediction_t *p)
{
    const double determinant = (p->a * p->d) - (p->b * p->b);
    return -0.5 * (weighted(p, p->nu, p->nu) + log(determinant) + (LN_TURN * (double)p->size));
}

static void gather(const prediction_t *given)
{
    for (uint32_t j = 0u; j < PARAMETERS; j++) {
        const double column[INNOVATION_OUTPUTS] = {given->t[0][j], given->t[1][j]};
        block.score[j] += weighted(given, column, given->nu);
        for (uint32_t k = 0u; k <= j; k++) {
            const double other[INNOVATION_OUTPUTS] = {given->t[0][k], given->t[1][k]};
            block.information[j][k] += weighted(given, column, other);
        }
    }
}

/* (s^T (I + L)^-1 s - ln |I + L|) / 2 by Cholesky's factor, then an empty block. */
static double close_block(void)
{
    double c[MODEL_PARAMETERS][MODEL_PARAMETERS];
    double z[MODEL_PARAMETERS];
    double sum = 0.0;
    for (uint32_t i = 0u; i < PARAMETERS; i++) {
        z[i] = block.score[i];
        for (uint32_t j = 0u; j <= i; j++) {
            double element = block.information[i][j] + ((i == j) ? 1.0 : 0.0);
            for (uint32_t k = 0u; k < j; k++) {
                element -= c[i][k] * c[j][k];
            }
            c[i][j] = (i == j) ? sqrt(element) : (element / c[j][j]);
        }
        for (uint32_t k = 0u; k < i; k++) {
            z[i] -= c[i][k] * z[k];
        }
        z[i] /= c[i][i];
        sum += (0.5 * squared(z[i])) - log(c[i][i]);
    }
    (void)memset(&block, 0, sizeof block);
    return sum;
}

float dual_update(dual_t *dual, const measurement_t *measurement, bool learn)
{
    if (current != NULL) {
        const prediction_t given = predicted(dual, measurement);
        const prediction_t all = marginal(&given);
        current->log_likelihood += log_density(learn ? &given : &all);
        current->nis = (float)weighted(&all, all.nu, all.nu);
        current->size = all.size;
        current->learns = learn;
        const double variance[INNOVATION_OUTPUTS] = {all.a, all.d};
        for (uint32_t i = 0u; i < BOTH; i++) {
            current->value[i] = (float)all.nu[i];
            current->sigma[i] = measurement->valid[i] ? (float)sqrt(variance[i]) : 0.0f;
        }
        if (learn) {
            gather(&given);
        }
    }
    return firmware_update(dual, measurement, learn);
}

bool dual_learn(dual_t *dual, float period, float caution, bool joint, float correction[MODEL_PARAMETERS],
    float learnt[MODEL_PARAMETERS])
{
    if (current != NULL) {
        current->log_likelihood += close_block();
    }
    return firmware_learn(dual, period, caution, joint, correction, learnt);
}

void dual_open(dual_t *dual)
{
    if (current != NULL) {
        current->log_likelihood += close_block();
    }
    firmware_open(dual);
}

bool innovation_run(
    const lever_config_t *config, const lever_sample_t *samples, uint32_t count, innovation_t *innovations)
{
    static lever_memory_t memory;
    lever_t *lever = lever_init(&memory, config);
    (void)memset(innovations, 0, (size_t)count * sizeof innovations[0]);
    (void)memset(&block, 0, sizeof block);
    for (uint32_t k = 0u; (lever != NULL) && (k < count); k++) {
        current = &innovations[k];
        (void)lever_update(lever, &samples[k]);
    }
    current = NULL;
    return lever != NULL;
}

uint32_t innovation_samples(
    const lever_frame_t *frames, uint32_t count, lever_sample_t *samples, lever_health_t *health)
{
    static estimator_t estimator;
    static link_t link;
    lever_config_t config;
    uint32_t taken = 0u;
    lever_config_default(&config);
    estimator_init(&estimator, &config);
    link_init(&link);
    for (uint32_t k = 0u; k < count; k++) {
        if (link_on_frame(&link, &estimator, &frames[k]) == LEVER_FRAME_SAMPLE) {
            samples[taken] = link.sample;
            taken++;
            (void)link_step(&link, &estimator);
        }
    }
    estimator_health(&estimator, health);
    return taken;
}
