/* The CAN side of an instance: received frames become samples and commands, estimates become frames to send. */
#ifndef APP_LINK_H
#define APP_LINK_H

#include "can/e2e.h"
#include "can/messages.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

/* Messages that are sent, in the order in which they are fetched: what is to act first, STATE_ESTIMATE last. */
enum link_output {
    OUTPUT_MOTOR_COMMAND,
    OUTPUT_CORRECTION,
    OUTPUT_COMMAND_ACK,
    OUTPUT_PARAMETERS,
    OUTPUT_SIGMA,
    OUTPUT_DYNAMICS,
    OUTPUT_FEEDTHROUGH,
    OUTPUT_STABILITY,
    OUTPUT_HEALTH,
    OUTPUT_LINK_HEALTH,
    OUTPUT_PLATFORM,
    OUTPUT_IDENTITY,
    OUTPUT_STATE_ESTIMATE,
    OUTPUTS
};

typedef struct link {
    e2e_receiver_t lever_receiver;
    e2e_receiver_t base_receiver;
    e2e_receiver_t grip_receiver;
    e2e_receiver_t command_receiver;
    message_lever_sample_t lever_sample; /* waiting for its BASE_SAMPLE */
    message_grip_sample_t grip_sample;   /* likewise */
    uint8_t lever_counter;
    uint8_t grip_counter;
    bool has_lever_sample;
    bool has_grip_sample;
    bool has_sample;
    lever_sample_t sample; /* complete, waiting for lever_step() */
    uint32_t period_us;    /* of a sample, nominal */
    uint32_t publish_us;   /* publish_period */
    uint32_t time_us;      /* of the last sample, late or not */
    uint32_t set_us;       /* since the last set of divided messages began */
    uint32_t identity_us;  /* since IDENTITY was last begun */
    uint32_t duplicate_us; /* time for which to report another estimator */
    uint32_t latched;      /* faults since the last HEALTH */
    uint32_t settings_crc;
    uint16_t due;            /* messages still to fetch, a bit each */
    uint8_t parts;           /* how many of the set are out, or due */
    uint8_t pages;           /* of IDENTITY still to send, a bit each */
    uint8_t frequency;       /* of the next FEEDTHROUGH [Hz] */
    uint8_t command_counter; /* of the last COMMAND, and what became of it */
    uint8_t command_result;
    uint8_t counter[OUTPUTS]; /* E2E counter of the next frame of each */
} link_t;

/* All of it is zero before. */
void link_init(link_t *link, const lever_settings_t *settings);

/* The functions of lever_cdkf.h of the same names. */
enum lever_frame_result link_on_frame(lever_t *lever, const lever_frame_t *frame);
void link_refuse(lever_t *lever, const lever_frame_t *command, uint8_t result);
enum lever_mode link_step(lever_t *lever);
void link_idle(lever_t *lever, uint32_t elapsed_us);
bool link_next_frame(lever_t *lever, lever_frame_t *frame);

/* Encodes a message that is due, as the instance is now. */
bool link_encode(lever_t *lever, enum link_output output, lever_frame_t *frame);

#endif
