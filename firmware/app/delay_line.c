#include "app/delay_line.h"

#include "math/bounds.h"

#include <string.h>

enum { THETA, THETA_DOT, TAU_M, GRIP_FORCE, COMMANDED };

#define BIT(signal) ((uint32_t)1u << (uint32_t)(signal))

void delay_line_start(delay_line_t *line)
{
    (void)memset(line, 0, sizeof *line);
}

/* Exchanges the sample for the oldest one in the line. */
static void exchange(float value[DELAY_LINE_SIGNALS], uint8_t *valid, lever_sample_t *sample, float *commanded)
{
    const float now[DELAY_LINE_SIGNALS] = {
        sample->theta, sample->theta_dot, sample->tau_m, sample->grip_force, *commanded};
    const uint32_t was = *valid;
    *valid = (uint8_t)((sample->theta_valid ? BIT(THETA) : 0u) | (sample->theta_dot_valid ? BIT(THETA_DOT) : 0u) |
                       (sample->tau_m_valid ? BIT(TAU_M) : 0u) | (sample->grip_force_valid ? BIT(GRIP_FORCE) : 0u));
    sample->theta = value[THETA];
    sample->theta_dot = value[THETA_DOT];
    sample->tau_m = value[TAU_M];
    sample->grip_force = value[GRIP_FORCE];
    *commanded = value[COMMANDED];
    sample->theta_valid = ((was & BIT(THETA)) != 0u);
    sample->theta_dot_valid = ((was & BIT(THETA_DOT)) != 0u);
    sample->tau_m_valid = ((was & BIT(TAU_M)) != 0u);
    sample->grip_force_valid = ((was & BIT(GRIP_FORCE)) != 0u);
    (void)memcpy(value, now, sizeof now);
}

void delay_line_pass(delay_line_t *line, uint32_t length, uint32_t periods, lever_sample_t *sample, float *commanded)
{
    if (length > 0u) {
        const uint32_t lost = lesser_count(periods - 1u, length);
        for (uint32_t i = 0u; i < lost; i++) {
            line->valid[line->next] = 0u;
            line->value[line->next][COMMANDED] = *commanded;
            line->next = (uint8_t)((line->next + 1u) % length);
        }
        exchange(line->value[line->next], &line->valid[line->next], sample, commanded);
        line->next = (uint8_t)((line->next + 1u) % length);
    }
}
