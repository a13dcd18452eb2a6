/* What tuning needs and a bus does not carry: the innovations of the estimator, and how likely its samples were to it.
 *
 * The estimator is the firmware's own code; innovations.c watches it at the seam between app/ and filter/. One call at
 * a time in a process, since where it writes is static.
 */
#ifndef INNOVATIONS_H
#define INNOVATIONS_H

#include <stdbool.h>
#include <stdint.h>

struct lever_config; /* of lever_cdkf.h */
struct lever_frame;
struct lever_health;
struct lever_sample;

enum innovation_limits { INNOVATION_OUTPUTS = 2 }; /* theta [rad], theta_dot [rad/s] */

/* What the estimator made of one sample. */
typedef struct sample_innovation {
    double log_likelihood;           /* ln of the density that was predicted for the outputs [SI units] */
    float value[INNOVATION_OUTPUTS]; /* measured minus predicted; 0 for an output that was not used */
    float sigma[INNOVATION_OUTPUTS]; /* its predicted standard deviation; 0 likewise */
    float nis;                       /* normalised innovation squared, chi-square with `size` degrees of freedom */
    uint8_t size;                    /* outputs used; 0 while aligning */
    bool learns;                     /* the parameters learn from the block that it is in */
    bool changed;                    /* a change of the arm was found lately: LEVER_FAULT_CHANGE */
} sample_innovation_t;

/* Feeds `count` samples to a fresh estimator, one innovation for each. False if the configuration is refused. */
bool innovation_run(const struct lever_config *config, const struct lever_sample *samples, uint32_t count,
    sample_innovation_t *innovations);

/* The samples that the firmware makes of received frames, in their order and after all its checks, at most one a frame.
 * Returns how many. `config` has the choices that commands among them have made, `health` what was lost, corrupt or
 * late. */
uint32_t innovation_samples(const struct lever_frame *frames, uint32_t count, struct lever_sample *samples,
    struct lever_config *config, struct lever_health *health);

#endif
