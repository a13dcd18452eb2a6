/* What the CAN side of an instance keeps: link.c and link_out.c work with it. */
#ifndef APP_LINK_TYPES_H
#define APP_LINK_TYPES_H

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
    OUTPUT_TEST_RATIO,
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
    uint8_t evidence;        /* of the next TEST_RATIO */
    uint8_t frequency;       /* of the next FEEDTHROUGH [Hz] */
    uint8_t command_counter; /* of the last COMMAND, and what became of it */
    uint8_t command_result;
    uint8_t counter[OUTPUTS]; /* E2E counter of the next frame of each */
} link_t;

#endif
