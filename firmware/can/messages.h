/* The messages of lever.dbc as structs, and their way into and out of an 8-byte payload.
 *
 * A struct has the signals of its message under the DBC's names, in the DBC's units; resolution and range are the DBC's.
 * CRC and counter are the business of e2e.h: encode, then e2e_protect(); e2e_check(), then decode.
 *
 * ..._encode() writes identifier, length and all payload bits (unused ones, CRC and counter as 0) and returns true, or
 * returns false and leaves the frame untouched.
 *   - Physical values are rounded to the nearest count, half away from zero (cantools: half to even), and saturate at
 *     the limits of the signal, infinities too. NaN is refused. The value is scaled in single precision, which can
 *     decide only a value within 0.004 counts of a tie.
 *   - Codes, flags and counts too large for their field are refused: the nearest code would mean something else.
 *   - A value whose flag is false is not read, and sent as 0.
 * ..._decode() returns true, or false and leaves the message untouched when identifier or length is not the message's,
 * or its model not known. Each value is the float nearest to the DBC's decimal value, so encoding it gives the same bits
 * again. Codes are not judged here.
 *
 * Cost on a Cortex-M4F at -Os: at most 250 instructions to encode and 120 to decode a message.
 */
#ifndef CAN_MESSAGES_H
#define CAN_MESSAGES_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"

enum message_id {
    MESSAGE_LEVER_SAMPLE_ID = 0x110,
    MESSAGE_BASE_SAMPLE_ID = 0x111,
    MESSAGE_COMMAND_ID = 0x120,
    MESSAGE_STATE_ESTIMATE_ID = 0x210,
    MESSAGE_PILOT_PARAMETERS_ID = 0x211,
    MESSAGE_PILOT_SIGMA_ID = 0x212,
    MESSAGE_PILOT_DYNAMICS_ID = 0x213,
    MESSAGE_HEALTH_ID = 0x214,
    MESSAGE_MOTOR_COMMAND_ID = 0x215,
    MESSAGE_PLATFORM_HEALTH_ID = 0x216,
    MESSAGE_IDENTITY_ID = 0x217
};

/* The data_id_base of each message for e2e.h: attribute E2EDataIdBase of the DBC. */
enum message_data_id {
    MESSAGE_LEVER_SAMPLE_DATA_ID = 1,
    MESSAGE_BASE_SAMPLE_DATA_ID = 17,
    MESSAGE_COMMAND_DATA_ID = 33,
    MESSAGE_STATE_ESTIMATE_DATA_ID = 49,
    MESSAGE_PILOT_PARAMETERS_DATA_ID = 65,
    MESSAGE_PILOT_SIGMA_DATA_ID = 81,
    MESSAGE_PILOT_DYNAMICS_DATA_ID = 97,
    MESSAGE_HEALTH_DATA_ID = 113,
    MESSAGE_MOTOR_COMMAND_DATA_ID = 129,
    MESSAGE_PLATFORM_HEALTH_DATA_ID = 145
};

/* --- to the estimator ------------------------------------------------------------------------------------------ */

typedef struct message_lever_sample {
    float theta;     /* [rad] */
    float theta_dot; /* [rad/s] */
    float tau_m;     /* [N m] */
    bool theta_valid;
    bool theta_dot_valid;
    bool tau_m_valid;
} message_lever_sample_t;

bool message_lever_sample_encode(lever_frame_t *frame, const message_lever_sample_t *message);
bool message_lever_sample_decode(message_lever_sample_t *message, const lever_frame_t *frame);

typedef struct message_base_sample {
    uint32_t time_us; /* [us], exact */
    float z_ddot;     /* [m/s^2] */
    bool z_ddot_valid;
} message_base_sample_t;

bool message_base_sample_encode(lever_frame_t *frame, const message_base_sample_t *message);
bool message_base_sample_decode(message_base_sample_t *message, const lever_frame_t *frame);

typedef lever_command_t message_command_t; /* what lever_command() takes */

bool message_command_encode(lever_frame_t *frame, const message_command_t *message);
bool message_command_decode(message_command_t *message, const lever_frame_t *frame);

/* --- from the estimator ---------------------------------------------------------------------------------------- */

typedef struct message_state_estimate {
    float theta;     /* [rad] */
    float theta_dot; /* [rad/s] */
    float nis;       /* [1] */
    uint8_t model;   /* enum lever_model, here and below */
} message_state_estimate_t;

bool message_state_estimate_encode(lever_frame_t *frame, const message_state_estimate_t *message);
bool message_state_estimate_decode(message_state_estimate_t *message, const lever_frame_t *frame);

/* The parameters of the model in their order: for the lever m_p [kg], c_p [N s/m], k_p [N/m]. */
typedef struct message_pilot_parameters {
    float parameter[LEVER_PARAMETERS];
    uint8_t model; /* not known: refused in both directions */
} message_pilot_parameters_t;

bool message_pilot_parameters_encode(lever_frame_t *frame, const message_pilot_parameters_t *message);
bool message_pilot_parameters_decode(message_pilot_parameters_t *message, const lever_frame_t *frame);

/* The standard deviations of the same, in the same units. */
typedef struct message_pilot_sigma {
    float sigma[LEVER_PARAMETERS];
    uint8_t model; /* not known: refused in both directions */
} message_pilot_sigma_t;

bool message_pilot_sigma_encode(lever_frame_t *frame, const message_pilot_sigma_t *message);
bool message_pilot_sigma_decode(message_pilot_sigma_t *message, const lever_frame_t *frame);

typedef struct message_pilot_dynamics {
    float natural_frequency;       /* [Hz] */
    float natural_frequency_sigma; /* [Hz] */
    float damping_ratio;           /* [1] */
    float damping_ratio_sigma;     /* [1] */
    uint8_t model;
} message_pilot_dynamics_t;

bool message_pilot_dynamics_encode(lever_frame_t *frame, const message_pilot_dynamics_t *message);
bool message_pilot_dynamics_decode(message_pilot_dynamics_t *message, const lever_frame_t *frame);

typedef struct message_health {
    float excitation; /* [rad/s] */
    uint16_t faults;  /* of enum lever_fault; 12 bits */
    uint8_t mode;     /* enum lever_mode */
    uint8_t lost;     /* the low eight bits of the counts of lever_health_t */
    uint8_t corrupt;
    uint8_t late;
    uint8_t model;
} message_health_t;

bool message_health_encode(lever_frame_t *frame, const message_health_t *message);
bool message_health_decode(message_health_t *message, const lever_frame_t *frame);

typedef struct message_motor_command {
    float torque; /* [N m] */
    float dither; /* the part of torque that is identification dither [N m] */
    uint8_t model;
} message_motor_command_t;

bool message_motor_command_encode(lever_frame_t *frame, const message_motor_command_t *message);
bool message_motor_command_decode(message_motor_command_t *message, const lever_frame_t *frame);

typedef struct message_platform_health {
    uint8_t faults; /* of enum lever_platform_fault */
    uint8_t transmit_errors;
    uint8_t receive_errors;
    uint8_t bus_offs; /* the low eight bits of the counts of lever_platform_t, here and below */
    uint8_t overruns;
    uint8_t dropped;
    uint8_t model;
} message_platform_health_t;

bool message_platform_health_encode(lever_frame_t *frame, const message_platform_health_t *message);
bool message_platform_health_decode(message_platform_health_t *message, const lever_frame_t *frame);

#endif
