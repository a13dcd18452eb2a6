/* The messages of lever.dbc as structs, and their way into and out of an 8-byte payload.
 *
 * A struct has the signals of its message under the DBC's names, in the DBC's units; resolution and range are the
 * DBC's. CRC and counter are the business of e2e.h: encode, then e2e_protect(); e2e_check(), then decode.
 *
 * ..._encode() writes identifier, length and all payload bits (unused ones, CRC and counter as 0) and returns true, or
 * returns false and leaves the frame untouched.
 *   - Physical values are rounded to the nearest count, half to even. The value is scaled in single precision, which
 *     can
 *     decide only a value within 0.004 counts of a tie.
 *   - A value that is NaN or does not fit its signal is sent as "not available": a smaller one would be wrong, and a
 *     standard deviation confident. In the samples its flag says so, too.
 *   - Codes, flags and counts too large for their field are refused: the nearest code would mean something else.
 *   - An input whose flag is false is not read, and sent as 0. ..._decode() returns true, or false and leaves the
 *     message untouched when identifier or length is not the message's, or its model or page not known. Each value is
 *     the float nearest to the DBC's decimal value, so encoding it gives the same bits again; one that is not available
 *     is NaN, and in the samples its flag false. Codes are not judged here.
 *
 * Cost on a Cortex-M4F at -Os: at most 250 instructions to encode and 200 to decode a message.
 */
#ifndef CAN_MESSAGES_H
#define CAN_MESSAGES_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"

enum { MESSAGE_CONTRACT = 2 }; /* VERSION of the DBC */

enum message_id {
    MESSAGE_LEVER_SAMPLE_ID = 0x110,
    MESSAGE_BASE_SAMPLE_ID = 0x111,
    MESSAGE_GRIP_SAMPLE_ID = 0x112,
    MESSAGE_COMMAND_ID = 0x120,
    MESSAGE_STATE_ESTIMATE_ID = 0x210,
    MESSAGE_PILOT_PARAMETERS_ID = 0x211,
    MESSAGE_PILOT_SIGMA_ID = 0x212,
    MESSAGE_PILOT_DYNAMICS_ID = 0x213,
    MESSAGE_HEALTH_ID = 0x214,
    MESSAGE_MOTOR_COMMAND_ID = 0x215,
    MESSAGE_PLATFORM_HEALTH_ID = 0x216,
    MESSAGE_IDENTITY_ID = 0x217,
    MESSAGE_COMMAND_ACK_ID = 0x218,
    MESSAGE_LINK_HEALTH_ID = 0x219,
    MESSAGE_FEEDTHROUGH_ID = 0x21A,
    MESSAGE_STABILITY_ID = 0x21B,
    MESSAGE_CORRECTION_ID = 0x21C,
    MESSAGE_SNAPSHOT_ID = 0x21D,
    MESSAGE_TEST_RATIO_ID = 0x21E,
    MESSAGE_PLATFORM_RESET_ID = 0x21F
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
    MESSAGE_PLATFORM_HEALTH_DATA_ID = 145,
    MESSAGE_IDENTITY_DATA_ID = 161,
    MESSAGE_COMMAND_ACK_DATA_ID = 177,
    MESSAGE_LINK_HEALTH_DATA_ID = 193,
    MESSAGE_FEEDTHROUGH_DATA_ID = 209,
    MESSAGE_GRIP_SAMPLE_DATA_ID = 225,
    MESSAGE_STABILITY_DATA_ID = 240,
    MESSAGE_CORRECTION_DATA_ID = 9,
    MESSAGE_SNAPSHOT_DATA_ID = 25,
    MESSAGE_TEST_RATIO_DATA_ID = 41,
    MESSAGE_PLATFORM_RESET_DATA_ID = 73
};

/* --- to the estimator ------------------------------------------------------------------------------------------ */

/* The greatest values that a sample can carry, and the least with a minus. */
#define MESSAGE_THETA_MOST 3.2767f      /* [rad] */
#define MESSAGE_THETA_DOT_MOST 16.3835f /* [rad/s] */
#define MESSAGE_TAU_M_MOST 32.767f      /* [N m] */
#define MESSAGE_Z_DDOT_MOST 32.767f     /* [m/s^2] */

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

typedef struct message_grip_sample {
    float grip_force; /* [N] */
    bool grip_force_valid;
} message_grip_sample_t;

bool message_grip_sample_encode(lever_frame_t *frame, const message_grip_sample_t *message);
bool message_grip_sample_decode(message_grip_sample_t *message, const lever_frame_t *frame);

typedef lever_command_t
    message_command_t; /* what lever_command() takes; a dither_rms beyond 65.534 is sent, and comes, as
                                              65.535: keep. A negative one or NaN is refused */

bool message_command_encode(lever_frame_t *frame, const message_command_t *message);
bool message_command_decode(message_command_t *message, const lever_frame_t *frame);

/* --- from the estimator ---------------------------------------------------------------------------------------- */

typedef struct message_state_estimate {
    float theta;       /* [rad] */
    float theta_dot;   /* [rad/s] */
    float innovation;  /* normalised: sqrt(NIS) [1]; NaN without measurement */
    uint16_t time_low; /* low 16 bits of the sample time [us] */
    bool valid;        /* the estimate may be used */
} message_state_estimate_t;

bool message_state_estimate_encode(lever_frame_t *frame, const message_state_estimate_t *message);
bool message_state_estimate_decode(message_state_estimate_t *message, const lever_frame_t *frame);

/* The parameters of the model in their order: for the lever m_p [kg], c_p [N s/m], k_p [N/m]. */
typedef struct message_pilot_parameters {
    float parameter[LEVER_PARAMETERS];
    uint8_t model; /* enum lever_model, here and below; not known: refused in both directions */
    bool valid;    /* as above, here and below */
} message_pilot_parameters_t;

bool message_pilot_parameters_encode(lever_frame_t *frame, const message_pilot_parameters_t *message);
bool message_pilot_parameters_decode(message_pilot_parameters_t *message, const lever_frame_t *frame);

/* The standard deviations of the same, in the same units. */
typedef struct message_pilot_sigma {
    float sigma[LEVER_PARAMETERS];
    uint8_t model; /* not known: refused in both directions */
    bool valid;
} message_pilot_sigma_t;

bool message_pilot_sigma_encode(lever_frame_t *frame, const message_pilot_sigma_t *message);
bool message_pilot_sigma_decode(message_pilot_sigma_t *message, const lever_frame_t *frame);

typedef struct message_pilot_dynamics {
    float natural_frequency;       /* [Hz] */
    float natural_frequency_sigma; /* [Hz] */
    float damping_ratio;           /* [1] */
    float damping_ratio_sigma;     /* [1] */
    uint8_t model;
    bool valid;
} message_pilot_dynamics_t;

bool message_pilot_dynamics_encode(lever_frame_t *frame, const message_pilot_dynamics_t *message);
bool message_pilot_dynamics_decode(message_pilot_dynamics_t *message, const lever_frame_t *frame);

/* Frequencies that FEEDTHROUGH is sent for, one after the other in steps of 1 Hz [Hz]. */
enum { MESSAGE_FEEDTHROUGH_LOWEST = 2, MESSAGE_FEEDTHROUGH_HIGHEST = 8 };

typedef struct message_feedthrough {
    float real;        /* of theta/z_ddot [rad/(m/s^2)] */
    float imaginary;   /* [rad/(m/s^2)] */
    float gain_sigma;  /* relative [1] */
    float phase_sigma; /* [rad] */
    uint8_t frequency; /* [Hz] */
    bool valid;
} message_feedthrough_t;

bool message_feedthrough_encode(lever_frame_t *frame, const message_feedthrough_t *message);
bool message_feedthrough_decode(message_feedthrough_t *message, const lever_frame_t *frame);

#define MESSAGE_TEST_RATIO_MOST 65.534f /* stands for any greater one */

typedef struct message_test_ratio {
    float ratio;      /* statistic over its threshold [1] */
    uint8_t evidence; /* which: enum evidence_id of app/evidence.def */
    uint8_t verdict;  /* enum verdict of app/verdict.def */
    bool present;     /* the statistic is over its threshold, or not yet below where it is withdrawn */
} message_test_ratio_t;

bool message_test_ratio_encode(lever_frame_t *frame, const message_test_ratio_t *message);
bool message_test_ratio_decode(message_test_ratio_t *message, const lever_frame_t *frame);

typedef struct message_stability {
    float gain_margin; /* [dB] */
    float gain_margin_sigma;
    float modulus; /* [1] */
    float modulus_sigma;
    float frequency; /* [Hz] */
    uint8_t bounce;  /* enum lever_bounce */
    bool valid;
} message_stability_t;

bool message_stability_encode(lever_frame_t *frame, const message_stability_t *message);
bool message_stability_decode(message_stability_t *message, const lever_frame_t *frame);

typedef struct message_correction {
    float correction; /* [rad] */
    float weight;     /* [1] */
    uint16_t time_low;
    uint8_t mitigation; /* enum lever_mitigation */
    bool valid;         /* its gate is open */
} message_correction_t;

bool message_correction_encode(lever_frame_t *frame, const message_correction_t *message);
bool message_correction_decode(message_correction_t *message, const lever_frame_t *frame);

typedef struct message_health {
    float excitation; /* [rad/s] */
    uint32_t faults;  /* of enum lever_fault, present since the last HEALTH; 24 bits */
    uint8_t mode;     /* enum lever_mode */
    uint8_t restarts; /* the low eight bits of lever_health_t.recoveries */
} message_health_t;

bool message_health_encode(lever_frame_t *frame, const message_health_t *message);
bool message_health_decode(message_health_t *message, const lever_frame_t *frame);

typedef struct message_motor_command {
    float torque; /* [N m] */
    float dither; /* the part of torque that is identification dither [N m] */
    uint16_t time_low;
    uint8_t model;
    bool valid; /* the torque gate is open */
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
    bool valid;
} message_platform_health_t;

bool message_platform_health_encode(lever_frame_t *frame, const message_platform_health_t *message);
bool message_platform_health_decode(message_platform_health_t *message, const lever_frame_t *frame);

enum message_cause {
    MESSAGE_CAUSE_UNKNOWN = 0,
    MESSAGE_CAUSE_POWER_ON = 1,
    MESSAGE_CAUSE_BROWN_OUT = 2,
    MESSAGE_CAUSE_PIN = 3,
    MESSAGE_CAUSE_SOFTWARE = 4, /* asked for, by a debugger, too */
    MESSAGE_CAUSE_WATCHDOG = 5,
    MESSAGE_CAUSE_HARD_FAULT = 6,
    MESSAGE_CAUSE_STACK_OVERFLOW = 7, /* a hard fault whose stack was not in memory */
    MESSAGE_CAUSE_CLOCK_FAILURE = 8
};

enum message_self_test {
    MESSAGE_SELF_TEST_ROM = 1,
    MESSAGE_SELF_TEST_RAM = 2,
    MESSAGE_SELF_TEST_STACK = 4,    /* was, once, deeper than it may be */
    MESSAGE_SELF_TEST_GOLDEN = 8,   /* the estimator did not give its golden vector at power-on */
    MESSAGE_SELF_TEST_SETTINGS = 16 /* settings or aircraft of the build are refused: nothing is estimated */
};

/* A port sends this one itself, with e2e_protect(). */
typedef struct message_platform_reset {
    uint32_t fault_address; /* instruction of the last hard fault since power-on; 0: none, or not known */
    uint8_t cause;          /* enum message_cause */
    uint8_t resets;         /* since power-on, the low eight bits */
    uint8_t failed;         /* of enum message_self_test, since the last reset */
} message_platform_reset_t;

bool message_platform_reset_encode(lever_frame_t *frame, const message_platform_reset_t *message);
bool message_platform_reset_decode(message_platform_reset_t *message, const lever_frame_t *frame);

enum message_page { MESSAGE_PAGE_VERSION = 0, MESSAGE_PAGE_SETTINGS = 1, MESSAGE_PAGE_CHOICES = 2, MESSAGE_PAGE_COUNT };

/* One page of it: only that page's members are sent, and what is received leaves the others 0. */
typedef struct message_identity {
    uint8_t page;           /* enum message_page; not known: refused in both directions */
    uint8_t firmware_major; /* page 0 */
    uint8_t firmware_minor;
    uint8_t firmware_patch;
    uint8_t contract;      /* VERSION of the DBC */
    uint32_t settings_crc; /* page 1: lever_settings_crc() */
    uint8_t model;         /* page 2 */
    uint8_t preload;
    uint8_t estimator;
    uint8_t adaptation;
    uint8_t mitigation;
    float dither_rms; /* as commanded [N m] */
} message_identity_t;

bool message_identity_encode(lever_frame_t *frame, const message_identity_t *message);
bool message_identity_decode(message_identity_t *message, const lever_frame_t *frame);

enum message_result {
    MESSAGE_RESULT_ACCEPTED = 0,
    MESSAGE_RESULT_UNKNOWN_VALUE = 1,
    MESSAGE_RESULT_SEQUENCE = 2,   /* repeated, or too old */
    MESSAGE_RESULT_FAULT_MODE = 3, /* in LEVER_MODE_FAULT only a reset is accepted */
    MESSAGE_RESULT_DISABLED = 4,   /* by command_guard.h, as the rest: the build takes no changes */
    MESSAGE_RESULT_ACTING = 5,     /* torque or a correction acts on the lever */
    MESSAGE_RESULT_NOT_SAFE = 6,   /* so says the machine */
    MESSAGE_RESULT_NOT_AUTHENTIC = 7,
    MESSAGE_RESULT_COUNT
};

typedef struct message_command_ack {
    uint8_t command_counter; /* of the COMMAND that this answers */
    uint8_t result;          /* enum message_result */
    uint8_t model;           /* the choices as they stand now, here and below */
    uint8_t preload;
    uint8_t estimator;
    uint8_t adaptation;
    uint8_t mitigation;
    float dither_rms; /* [N m] */
} message_command_ack_t;

bool message_command_ack_encode(lever_frame_t *frame, const message_command_ack_t *message);
bool message_command_ack_decode(message_command_ack_t *message, const lever_frame_t *frame);

typedef struct message_link_health {
    uint16_t lost; /* the low 16 bits of the counts of lever_health_t */
    uint16_t corrupt;
    uint16_t late;
    uint8_t model;
    bool valid;
} message_link_health_t;

bool message_link_health_encode(lever_frame_t *frame, const message_link_health_t *message);
bool message_link_health_decode(message_link_health_t *message, const lever_frame_t *frame);

enum message_part { MESSAGE_PART_BEGIN = 0, MESSAGE_PART_DATA = 1, MESSAGE_PART_END = 2, MESSAGE_PART_COUNT };

/* One part of a snapshot: only that part's members are sent, and what is received leaves the others 0. */
typedef struct message_snapshot {
    uint8_t part;      /* enum message_part; not known: refused in both directions */
    uint32_t time_us;  /* begin: of the sample after which the state was this */
    uint16_t layout;   /* lever_state_layout() */
    uint32_t data_low; /* data: the next six bytes of the state, lowest first */
    uint16_t data_high;
    uint32_t digest; /* end: CRC-32 over the bytes of the state */
    uint16_t length; /* how many these are */
} message_snapshot_t;

bool message_snapshot_encode(lever_frame_t *frame, const message_snapshot_t *message);
bool message_snapshot_decode(message_snapshot_t *message, const lever_frame_t *frame);

#endif
