/* The CAN side of an instance: received frames become samples and commands, estimates become frames to send. */
#ifndef APP_LINK_H
#define APP_LINK_H

#include "app/estimator.h"
#include "can/e2e.h"
#include "can/messages.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

enum { LINK_OUTPUTS = 7 }; /* messages that are sent */

typedef struct link {
    e2e_receiver_t lever_receiver;
    e2e_receiver_t base_receiver;
    e2e_receiver_t command_receiver;
    message_lever_sample_t lever_sample; /* waiting for its BASE_SAMPLE */
    uint8_t lever_counter;
    bool has_lever_sample;
    lever_sample_t sample; /* complete, waiting for lever_step() */
    bool has_sample;
    uint32_t published_us; /* sample time at which the last set of divided messages began */
    uint8_t published;     /* how many of it are out, or due */
    bool has_published;
    uint8_t due;                   /* messages still to fetch, a bit each */
    uint8_t counter[LINK_OUTPUTS]; /* E2E counter of the next frame of each */
} link_t;

void link_init(link_t *link);

/* The functions of lever_cdkf.h of the same names. */
enum lever_frame_result link_on_frame(link_t *link, estimator_t *estimator, const lever_frame_t *frame);
enum lever_mode link_step(link_t *link, estimator_t *estimator);
bool link_next_frame(link_t *link, const estimator_t *estimator, lever_frame_t *frame);

#endif
