/* Lever CDKF: a helicopter pilot's equivalent mass, damping and stiffness on the collective lever, estimated on line.
 *
 * This header is the whole outside of the firmware; no other header is needed, and nothing below it is promised.
 *
 * What it does. A square-root Central Difference Kalman Filter (single precision, fixed size) estimates the angle and
 * rate of the lever and, in step with them, the pilot's parameters [m_p, c_p, k_p], each with its standard deviation;
 * or those of a linear model, for an arm on another device.
 *
 * What it needs. A sample each sample_period: lever angle and rate, base vertical acceleration, motor torque. It uses
 * no heap, operating system, clock, thread, or mutable static; all memory is the caller's, time comes with the samples.
 *
 * Two ways to use it, on the same instance type:
 *
 *     lever_memory_t memory;                        // the caller's, both, e.g. static
 *     lever_config_t config;
 *     lever_config_default(&config);
 *     lever_t *lever = lever_init(&memory, &config);   // NULL: config refused, lever_config_check() says where
 *
 *     // without CAN                                // with CAN
 *     lever_update(lever, &sample);                 if (lever_on_frame(lever, &rx) == LEVER_FRAME_SAMPLE) {
 *     lever_estimate(lever, &estimate);                 lever_step(lever);
 *                                                   }
 *                                                   while (lever_next_frame(lever, &tx)) { transmit(&tx); }
 *
 * Threads. An instance belongs to one thread (or interrupt level) at a time; different instances are independent. Cost.
 * Every call is bounded; lever_update() is the expensive one: 2,760 instructions and 4,300 cycles on a Cortex-M4F on
 * average (lever model, as shipped), 8,060 instructions when the parameters learn (once a learn_period), 18,400 at the
 * first sample after a gap; with an aircraft and a mitigation 3,830 on average, and 19,300 at a sample with a margin
 * (25 a second). 40 KiB of code, 2.32 KiB an instance, less than 1 KiB of stack (firmware/port/PORTING.md).
 * Numbers. Results are bit-identical on every IEEE 754 machine when built with this project's flags.
 */
#ifndef LEVER_CDKF_H
#define LEVER_CDKF_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Semantic version of API, wire and settings: firmware/CHANGELOG.md says what changed. */
#define LEVER_VERSION_MAJOR 0
#define LEVER_VERSION_MINOR 2
#define LEVER_VERSION_PATCH 0

/* --- configuration --------------------------------------------------------------------------------------------- */

/* Model of arm and lever: see firmware/model. */
enum lever_model {
    LEVER_MODEL_LEVER = 0,            /* nonlinear lever and arm: m_p [kg], c_p [N s/m], k_p [N/m] */
    LEVER_MODEL_LINEAR_PHYSICAL = 1,  /* mass, spring, damper on a base: m [kg], c [N s/m], k [N/m] */
    LEVER_MODEL_LINEAR_BLACK_BOX = 2, /* second-order system: a21 [1/s^2], a22 [1/s], b21, of any sign */
    LEVER_MODEL_HAND = 3,             /* hand damped in space, too: k_hand [1/s^2], c_hand [1/s], c_space [1/s] */
    LEVER_MODEL_COUNT
};

/* Where the springs rest. FIXED: at the two preload angles of the settings. TRIM: the pilot re-trims; gravity
 * cancels at a trim angle that follows theta slowly, and all signals count from their slow part (trim_corner). */
enum lever_preload { LEVER_PRELOAD_FIXED = 0, LEVER_PRELOAD_TRIM = 1, LEVER_PRELOAD_COUNT };

/* How state and parameters are estimated together. DUAL: two filters in step, of which the state's takes the parameters
 * as they are. JOINT: one filter on both, for which what the parameters may have done since the last sample also is
 * uncertainty of the state. */
enum lever_estimator { LEVER_ESTIMATOR_DUAL = 0, LEVER_ESTIMATOR_JOINT = 1, LEVER_ESTIMATOR_COUNT };

/* How the parameter noise is set: FIXED walk; ANNEALING from ceiling to floor; ROBBINS_MONRO between floor and ceiling;
 * FORGETTING, in proportion to the parameters' own covariance. */
enum lever_adaptation {
    LEVER_ADAPTATION_FIXED = 0,
    LEVER_ADAPTATION_ANNEALING = 1,
    LEVER_ADAPTATION_ROBBINS_MONRO = 2,
    LEVER_ADAPTATION_FORGETTING = 3,
    LEVER_ADAPTATION_COUNT
};

/* What is done against collective bounce: firmware/bounce/README.md. CANCELLATION takes the involuntary part, as the
 * estimated arm makes it of the base acceleration, from the lever's angle; NOTCH what is at the arm's natural
 * frequency; DAMPING is torque against the lever's rate. */
enum lever_mitigation {
    LEVER_MITIGATION_NONE = 0,
    LEVER_MITIGATION_DAMPING = 1,
    LEVER_MITIGATION_CANCELLATION = 2,
    LEVER_MITIGATION_CANCELLATION_AND_DAMPING = 3,
    LEVER_MITIGATION_NOTCH = 4,
    LEVER_MITIGATION_NOTCH_AND_DAMPING = 5,
    LEVER_MITIGATION_COUNT
};

/* Every tunable number, in SI units; see lever_settings.def for unit, default, range and meaning of each. */
typedef struct lever_settings {
/* cppcheck-suppress misra-c2012-20.7 ; D1 */
#define LEVER_SETTING(name, unit, value, least, greatest, meaning) float name;
#include "lever_settings.def"
} lever_settings_t;

typedef struct lever_config {
    uint8_t model;      /* enum lever_model */
    uint8_t preload;    /* enum lever_preload */
    uint8_t estimator;  /* enum lever_estimator */
    uint8_t adaptation; /* enum lever_adaptation */
    uint8_t mitigation; /* enum lever_mitigation */
    lever_settings_t settings;
} lever_config_t;

/* One row of lever_settings.def. */
typedef struct lever_setting {
    const char *name;
    const char *unit;
    const char *meaning;
    float value; /* default */
    float least;
    float greatest;
} lever_setting_t;

/* Number of settings, and the row at `index` (NULL when index >= count). lever_settings_t is an array of that many
 * floats in the order of the rows. */
uint32_t lever_setting_count(void);
const lever_setting_t *lever_setting(uint32_t index);

/* Fills in the defaults: lever model, trim preload, dual estimator, Robbins-Monro, no mitigation. */
void lever_config_default(lever_config_t *config);

/* NULL when the configuration is usable, otherwise the name of the first thing that is out of range (a setting, or
 * "model", "preload", "estimator", "adaptation", "mitigation"), or of a setting that does not go with another; its
 * meaning says with which. */
const char *lever_config_check(const lever_config_t *config);

/* CRC-32 (IEEE 802.3) over the settings in their order, each as the four bytes of its float, lowest first. */
uint32_t lever_settings_crc(const lever_settings_t *settings);

/* --- life ------------------------------------------------------------------------------------------------------ */

/* Room for one instance: 2,464 bytes, and 24 more where pointers have 64 bits. */
typedef struct lever_room {
    const void *pointers[6];
    uint8_t rest[2440];
} lever_room_t;
typedef union lever_memory {
    uint64_t aligned;
    lever_room_t room;
} lever_memory_t;

typedef struct lever lever_t;

/* Makes an instance in `memory`. Memory and configuration are the caller's, and must outlive it; the configuration, of
 * which the instance reads the settings, must not change meanwhile, and may be constant, in flash, and shared by
 * instances. There is nothing to release. Returns NULL, touching nothing, if the configuration is not usable. Also the
 * way to start over with another configuration. */
lever_t *lever_init(lever_memory_t *memory, const lever_config_t *config);

/* --- samples in ------------------------------------------------------------------------------------------------ */

/* One sample. A value whose flag is false is not read; a flagged value that is not finite counts as invalid. */
typedef struct lever_sample {
    uint32_t time_us; /* sample time [us], wraps at 2^32 */
    float theta;      /* lever angle from the floor [rad] */
    float theta_dot;  /* lever rate [rad/s] */
    float tau_m;      /* motor torque on the lever [N m]; when not valid, the commanded one, unless another drove */
    float
        z_ddot; /* base vertical acceleration, up positive, without gravity [m/s^2]; when not valid, the last is held */
    float grip_force; /* of the hand on the lever, across it, positive where it raises theta: mean since the last sample
                         [N]; used by the model lever, not needed */
    bool theta_valid;
    bool theta_dot_valid;
    bool tau_m_valid;
    bool z_ddot_valid;
    bool grip_force_valid;
} lever_sample_t;

enum lever_mode {
    LEVER_MODE_INIT = 0,   /* no usable sample yet: none with a valid theta or theta_dot, since the start or a reset */
    LEVER_MODE_ALIGN = 1,  /* averaging the first samples; estimates are the first guess */
    LEVER_MODE_RUN = 2,    /* estimating */
    LEVER_MODE_COAST = 3,  /* no usable theta or theta_dot: predicting, uncertainty grows */
    LEVER_MODE_FROZEN = 4, /* states are estimated, parameters held, by command */
    LEVER_MODE_FAULT = 5   /* the filter had to be restarted too often; only a reset leaves this mode */
};

/* Takes one sample: predicts to its time (through up to gap_limit of missing samples), then updates. Inputs between two
 * samples are taken as the mean of both. A sample not newer than the last is counted as late and ignored; when such
 * samples advance for gap_limit, their sender has restarted its clock, and the estimator aligns anew. Returns the mode
 * after the sample. */
enum lever_mode lever_update(lever_t *lever, const lever_sample_t *sample);

enum lever_request {
    LEVER_REQUEST_NONE = 0,
    LEVER_REQUEST_RUN = 1,    /* leave frozen */
    LEVER_REQUEST_FREEZE = 2, /* hold the parameters */
    LEVER_REQUEST_RESET = 3 /* back to the first guess, for a new series of samples; also leaves fault and ends dither.
                                  Counts go on */
};

enum lever_keep { LEVER_KEEP = 15 };

/* A command; a choice that is LEVER_KEEP stays as it is. */
typedef struct lever_command {
    uint8_t request;    /* enum lever_request */
    uint8_t model;      /* enum lever_model or LEVER_KEEP; a change resets the estimator */
    uint8_t preload;    /* enum lever_preload or LEVER_KEEP; a change resets the estimator */
    uint8_t estimator;  /* enum lever_estimator or LEVER_KEEP; a change resets the estimator */
    uint8_t adaptation; /* enum lever_adaptation or LEVER_KEEP */
    uint8_t mitigation; /* enum lever_mitigation or LEVER_KEEP */
    float dither_rms;   /* identification torque [N m]: 0 fades it out, torque_rms and torque_limit limit it, from
                           LEVER_KEEP on it stays as it is (on CAN: 65.535) */
} lever_command_t;

/* Carries a command out before the next sample. Returns false, changing nothing, if any part of it is not known. */
bool lever_command(lever_t *lever, const lever_command_t *command);

/* --- estimates out --------------------------------------------------------------------------------------------- */

enum lever_parameter_limits { LEVER_PARAMETERS = 3 };

typedef struct lever_estimate {
    uint32_t time_us; /* of what this is the estimate of: the last sample, less z_ddot_delay in whole samples [us] */
    float theta;      /* lever angle [rad] and its standard deviation */
    float theta_sigma;
    float theta_dot; /* lever rate [rad/s] and its standard deviation */
    float theta_dot_sigma;
    float parameter[LEVER_PARAMETERS];       /* of the model: [m_p kg, c_p N s/m, k_p N/m] for the lever */
    float parameter_sigma[LEVER_PARAMETERS]; /* their standard deviations, in the same units */
    float parameter_correlation
        [LEVER_PARAMETERS];  /* of their errors: first and second, first and third, second and third */
    float natural_frequency; /* undamped, of arm and lever about the trim [Hz] */
    float natural_frequency_sigma;
    float damping_ratio; /* [1] */
    float damping_ratio_sigma;
    float trim;       /* angle about which the dynamics are linearised [rad] */
    float nis;        /* normalised innovation squared of the last update, chi-square with nis_size degrees of
                         freedom when the filter is consistent; 0 without measurement */
    uint8_t nis_size; /* 0, 1 or 2 outputs used in the last update */
} lever_estimate_t;

/* The estimate after the last sample. Derived values are computed here, so this is not free (1,500 instructions). */
void lever_estimate(const lever_t *lever, lever_estimate_t *estimate);

/* Biodynamic feedthrough theta/z_ddot at one frequency, of the model linearised about the trim. The standard deviations
 * are those of the error along the phasor (the gain's) and across it (the phase's), by the covariance of the
 * parameters: they do not contain what the model itself cannot do, of which LEVER_FAULT_MISMATCH warns. */
typedef struct lever_feedthrough {
    float real;        /* [rad/(m/s^2)] */
    float imaginary;   /* negative where theta lags */
    float gain_sigma;  /* of the gain, relative to it [1] */
    float phase_sigma; /* [rad] */
    float correlation; /* of the errors of gain and phase [1] */
} lever_feedthrough_t;

/* At a frequency [Hz], after the last sample; collective bounce is at 2 to 8 Hz. Not finite where there is no response,
 * or an undamped model is in resonance. Not free (1,000 instructions). */
void lever_feedthrough(const lever_t *lever, float frequency, lever_feedthrough_t *feedthrough);

/* --- collective bounce ----------------------------------------------------------------------------------------- */

enum lever_aircraft_limits { LEVER_AIRCRAFT_POINTS = 24, LEVER_SEAT_MODES = 3 };

/* (by_rate s + by_place) / (s^2 + damping s + stiffness): a bending mode of the cabin between the
 * accelerometer and the seat. */
typedef struct lever_seat_mode {
    float by_rate;   /* [1/s] */
    float by_place;  /* [1/s^2] */
    float damping;   /* above 0 [1/s] */
    float stiffness; /* above 0 [1/s^2] */
} lever_seat_mode_t;

/* How a helicopter answers to its collective lever: vertical acceleration at the pilot's seat over the lever's
 * angle, up and raised positive, with gearing, delays and actuator, at frequencies about those of bounce: 1.5 to
 * 8 Hz. Where the accelerometer is not at the seat and seat_modes is 0, the acceleration is that at the
 * accelerometer. */
typedef struct lever_aircraft {
    uint8_t count;                          /* frequencies, at least 3 */
    float frequency[LEVER_AIRCRAFT_POINTS]; /* rising [Hz] */
    float real[LEVER_AIRCRAFT_POINTS];      /* [(m/s^2)/rad] */
    float imaginary[LEVER_AIRCRAFT_POINTS]; /* negative where the acceleration lags */
    float gain_sigma;                       /* how well that is known: of the gain, relative to it [1] */
    float phase_sigma;                      /* [rad] */
    float warning;                          /* gain margin below which there is a warning [dB] */
    float alarm;                            /* and an alarm [dB] */
    uint8_t seat_modes; /* 0: the accelerometer is at the seat, or the way from there to the seat is not known */
    float seat_direct;  /* z_ddot at the seat over that at the accelerometer: this, and the sum of the modes [1] */
    lever_seat_mode_t seat[LEVER_SEAT_MODES];
} lever_aircraft_t;

enum lever_bounce {
    LEVER_BOUNCE_UNKNOWN = 0, /* no aircraft, or the estimate does not carry it */
    LEVER_BOUNCE_CLEAR = 1,
    LEVER_BOUNCE_WARNING = 2,
    LEVER_BOUNCE_ALARM = 3
};

/* How near the loop through arm, lever and rotor is to instability. */
typedef struct lever_stability {
    uint8_t state; /* enum lever_bounce; UNKNOWN while it is not valid, but an ALARM stays */
    /* As in STABILITY: a sample with an output came within 20 ms or three sample periods, by the clock of the samples
     * or lever_idle(), the sample clock advances, and the margin is known. Else, the numbers are those known last. */
    bool valid;
    float gain_margin; /* by which the loop may grow until it is unstable, at most 40 [dB] */
    float gain_margin_sigma;
    float modulus; /* least |1 - L| of the loop L, negative where it is unstable [1] */
    float modulus_sigma;
    float frequency; /* at which it becomes unstable [Hz] */
    float frequency_sigma;
} lever_stability_t;

/* Watches the loop with this aircraft from now on; NULL: with none, as lever_init() leaves it. It is the caller's, and
 * must outlive the instance unchanged. Returns false, changing nothing, if it is not usable. */
bool lever_aircraft(lever_t *lever, const lever_aircraft_t *aircraft);

/* As of the last publish_period, or 40 ms where that is shorter; all but `state` is 0 before the first. A state is
 * entered when the margin is below its limit with a confidence of 80 % in the arm, and left when it is above with that.
 * ALARM stays while nothing better is known. */
void lever_stability(const lever_t *lever, lever_stability_t *stability);

/* What mitigation adds to the lever's angle, until the next sample: pitch = gearing (theta - trim + angle). */
typedef struct lever_correction {
    float angle;  /* [rad], at most correction_limit; 0 without mitigation, and where it is not permitted */
    float weight; /* of the fade: 0 passive, 1 all of it */
} lever_correction_t;

/* After the last sample, or lever_idle(). It fades in within a second while a command was accepted within the last
 * second, as for torque, and is 0 within 100 ms after that has ended, or theta, theta_dot, z_ddot, the sample clock or
 * the samples have failed: bounce/README.md says when. Where only the response to z_ddot is wrong, it goes on by what
 * the lever does. Whoever gets none for 100 ms takes 0. */
void lever_correction(const lever_t *lever, lever_correction_t *correction);

/* --- evidence --------------------------------------------------------------------------------------------------- */

enum lever_evidence_limits { LEVER_TEST_RATIOS = 16 };

/* The test ratio of each statistic that is watched for faults and changes: its value over its threshold, as at the end
 * of the last learn_period. Above 1 it is evidence, until it falls below a second threshold. The order is that of
 * firmware/app/evidence.def; lever_test_ratio_name() has the names. */
void lever_test_ratios(const lever_t *lever, float ratio[LEVER_TEST_RATIOS]);

/* --- names ------------------------------------------------------------------------------------------------------ */

/* Name ("m_p") and unit ("kg") of a parameter of a model; NULL for an index or model that does not exist. */
const char *lever_parameter_name(uint8_t model, uint32_t index);
const char *lever_parameter_unit(uint8_t model, uint32_t index);

/* Name of a statistic that is watched ("BASE_STUCK"); NULL for an index that does not exist. */
const char *lever_test_ratio_name(uint32_t index);

/* --- health ---------------------------------------------------------------------------------------------------- */

/* Conditions present at the last sample; none of them stops the estimator. HEALTH has those since the last HEALTH. */
enum lever_fault {
    LEVER_FAULT_THETA = 1,     /* theta missing, stuck or not plausible, or not the integral of theta_dot */
    LEVER_FAULT_THETA_DOT = 2, /* theta_dot missing, stuck or not plausible, or not the derivative of theta */
    LEVER_FAULT_TORQUE = 4,    /* motor torque missing (taken as what was asked for), or not what was asked for */
    LEVER_FAULT_BASE = 8,      /* base acceleration missing or stuck (the last is held), or not fitting the motion */
    LEVER_FAULT_GAP = 16,      /* samples were missing */
    LEVER_FAULT_COMMUNICATION = 32, /* a frame was corrupt, repeated, out of sequence or not understood */
    LEVER_FAULT_INNOVATION = 64,    /* innovations persistently larger than their predicted covariance */
    LEVER_FAULT_EXCITATION = 128,   /* too little motion to learn from; the parameters stand, and grow uncertain */
    LEVER_FAULT_BOUND = 256,        /* a parameter rests on a bound of its model */
    LEVER_FAULT_RECOVERED = 512,    /* an invalid factor or estimate was refused, and the filter restarted */
    LEVER_FAULT_CHANGE = 1024,      /* the pilot has changed suddenly within the last 3 s; learning anew */
    LEVER_FAULT_PLATFORM = 2048,    /* the machine reports a fault of its own: PLATFORM_HEALTH */
    LEVER_FAULT_CLOCK = 4096,       /* the sample clock stands, runs backwards or crawls (a quarter of sample_period) */
    LEVER_FAULT_DUPLICATE = 8192,   /* another estimator has spoken on this bus within the last 2 s */
    LEVER_FAULT_SETTLING = 16384,   /* nothing is learnt: the levels of the signals have not settled yet */
    LEVER_FAULT_MISMATCH = 32768,   /* innovations are not white, or the lever sticks: something that the model lacks */
    LEVER_FAULT_CALIBRATION = 65536, /* the inputs, or their times, do not agree: one is wrong or wrongly scaled */
    LEVER_FAULT_HANDS_OFF = 131072   /* nobody holds the lever; nothing is learnt */
};

/* Faults that say: do not trust the parameters, and what follows from them, while any of these is present. Tools and
 * tables count an estimate as flagged by this mask; in HEALTH a fault of one sample stands for a publish_period.
 * In it: THETA, THETA_DOT, TORQUE, BASE: an input is missing, and the estimate not of now; or it is wrong, and may have
 * been learnt from. CLOCK: samples are ignored, or not of the time they state. INNOVATION, MISMATCH: the standard
 * deviations do not hold. CALIBRATION: an input is scaled wrongly, and the parameters with it. BOUND, RECOVERED: a
 * value is that of its bound, or the first guess. HANDS_OFF: there is no pilot whose parameters these could be.
 * Not in it: EXCITATION, SETTLING (the parameters stand, and their standard deviations hold), CHANGE (followed, with
 * standard deviations that grow), GAP, COMMUNICATION, PLATFORM, DUPLICATE (of the link and the machine). */
enum lever_faults {
    LEVER_FAULTS_DO_NOT_TRUST = LEVER_FAULT_THETA | LEVER_FAULT_THETA_DOT | LEVER_FAULT_TORQUE | LEVER_FAULT_BASE |
    LEVER_FAULT_CLOCK | LEVER_FAULT_INNOVATION | LEVER_FAULT_MISMATCH | LEVER_FAULT_CALIBRATION | LEVER_FAULT_BOUND |
    LEVER_FAULT_RECOVERED | LEVER_FAULT_HANDS_OFF
};

typedef struct lever_health {
    enum lever_mode mode;
    uint32_t faults;  /* of enum lever_fault */
    uint32_t samples; /* samples taken */
    uint32_t lost;    /* samples or frames that never came */
    uint32_t corrupt; /* frames with a wrong CRC or length or an unknown command, values not finite or not plausible */
    uint32_t late;    /* samples or frames that came twice, out of order or too late */
    uint32_t recoveries; /* times that the filter was restarted */
    float excitation;    /* rms of theta_dot over excitation_time [rad/s] */
    float torque;        /* what the torque gate asks of the motor until the next sample [N m] */
    bool gate_open;      /* torque may be other than zero: see lever_idle() */
} lever_health_t;

void lever_health(const lever_t *lever, lever_health_t *health);

/* Conditions of the machine that the estimator runs on, for its port to report. */
enum lever_platform_fault {
    LEVER_PLATFORM_CLOCK = 1,       /* the crystal did not start: on a less accurate oscillator */
    LEVER_PLATFORM_ROM = 2,         /* the program memory does not have its checksum */
    LEVER_PLATFORM_SELF_TEST = 4,   /* a self test has failed: the golden vector, RAM, the stack */
    LEVER_PLATFORM_WATCHDOG = 8,    /* the last reset was the watchdog's */
    LEVER_PLATFORM_HARD_FAULT = 16, /* the last reset was that of a hard fault */
    LEVER_PLATFORM_BUS_OFF = 32,    /* the CAN controller is off the bus */
    LEVER_PLATFORM_OVERRUN = 64,    /* received frames have been lost since the last report */
    LEVER_PLATFORM_DROPPED = 128    /* frames to send have been dropped since the last report */
};

typedef struct lever_platform {
    uint8_t faults;          /* of enum lever_platform_fault */
    uint8_t transmit_errors; /* error counters of the CAN controller, as they stand */
    uint8_t receive_errors;
    uint8_t bus_offs;  /* times that the controller went off the bus */
    uint16_t overruns; /* received frames lost in the machine */
    uint16_t dropped;  /* frames to send dropped */
} lever_platform_t;

/* Takes the port's report, which stands until the next one. From the first report on PLATFORM_HEALTH is sent beside
 * HEALTH, and any of the faults raises LEVER_FAULT_PLATFORM. Without one nothing of it is sent. */
void lever_platform(lever_t *lever, const lever_platform_t *platform);

/* --- torque ---------------------------------------------------------------------------------------------------- */

/* All torque for the motor leaves through one gate: finite, then torque_limit, torque_slew, torque_rms over one second.
 * It is open while all of this holds; otherwise torque fades to exactly zero within 50 ms:
 *   - mode RUN or FROZEN, or COAST for as long as the next line allows;
 *   - a sample with a believed theta or theta_dot came within 20 ms or three sample periods, whichever is longer;
 *   - the sample clock advances;
 *   - a COMMAND, or lever_command(), was accepted within the last second of sample time: repeat one (keep-alive);
 *   - the platform reports none of ROM, SELF_TEST, WATCHDOG, HARD_FAULT, and the settings are as lever_init() found
 *     them: they are looked at each second, and a change raises LEVER_FAULT_PLATFORM for good;
 *   - since LEVER_FAULT_HANDS_OFF, or a motor found to do other than it is asked (LEVER_FAULT_TORQUE, but not for a
 *     torque that is only missing), a command has asked for torque anew, with that fault gone: by a dither or a
 *     mitigation that it names, where the command before it named none.
 * Opening takes dither_fade. */

/* Torque leaves, or will with the next sample; or mitigation adds to the angle. */
bool lever_is_acting(const lever_t *lever);

/* No sample came for elapsed_us since the last lever_step(), lever_update() or lever_idle(), by the port's own clock
 * [us]. The estimate stays; the gate and the fade of the correction age, and while these are not yet zero MOTOR_COMMAND
 * and CORRECTION become due: fetch them with lever_next_frame(). Call it when no sample has come for about 5 ms, and
 * again each 5 ms or so. */
void lever_idle(lever_t *lever, uint32_t elapsed_us);

/* --- CAN ------------------------------------------------------------------------------------------------------- */

/* A classic CAN frame with an 11-bit identifier; the messages are in firmware/can/lever.dbc. */
typedef struct lever_frame {
    uint32_t id;
    uint8_t length;
    uint8_t data[8];
} lever_frame_t;

enum lever_frame_result {
    LEVER_FRAME_IGNORED = 0, /* not for us */
    LEVER_FRAME_TAKEN = 1,   /* ours, and more is needed */
    LEVER_FRAME_SAMPLE = 2,  /* completed a sample: call lever_step() now */
    LEVER_FRAME_REFUSED = 3  /* ours, but corrupt, repeated, late, not understood or not accepted; counted */
};

/* Takes a received frame. BASE_SAMPLE completes the sample of its counter, with or without its LEVER_SAMPLE and
 * GRIP_SAMPLE, so send these first. */
enum lever_frame_result lever_on_frame(lever_t *lever, const lever_frame_t *frame);

/* A COMMAND that a port does not hand on is counted as refused, and answered by a COMMAND_ACK with this result, of enum
 * message_result in can/messages.h, if its CRC is correct. */
void lever_refuse(lever_t *lever, const lever_frame_t *command, uint8_t result);

/* lever_update() with the sample that lever_on_frame() has completed; without one it does nothing. Returns the mode. */
enum lever_mode lever_step(lever_t *lever);

/* The next frame to send; false when there is none left. Fetch after lever_step(), after every frame taken or refused
 * (a COMMAND is answered) and after lever_idle(). MOTOR_COMMAND and CORRECTION come first. Every step ends with one
 * STATE_ESTIMATE, so who has received that has everything the step gives. Frames not fetched before the next step are
 * replaced by newer ones. */
bool lever_next_frame(lever_t *lever, lever_frame_t *frame);

/* --- logs that begin anywhere ------------------------------------------------------------------------------------- */

/* The state of an instance as bytes, lowest first, the same on every machine: what its future depends on besides its
 * configuration, its aircraft and what it is given. Neither is called by anything else here, so that an image without
 * them is not larger for it. */
enum lever_state_limits { LEVER_STATE_BYTES = 2174 };

/* Which members the state has, of which version of the firmware; bytes with another number cannot be restored. */
uint16_t lever_state_layout(void);

/* Between two samples, when lever_next_frame() has nothing left. */
void lever_state_save(const lever_t *lever, uint8_t state[LEVER_STATE_BYTES]);

/* From then on the instance is as that was which was saved: for a replay, on a desktop; a controller must not take
 * its state from a bus. Returns false, changing nothing, if a value is out of its range or not finite, the filter
 * would break its invariant, the settings are others, or one of the two has an aircraft and the other has none.
 * Bytes that are accepted may make any estimate, but a finite one. Needs another instance on the stack. */
bool lever_state_restore(lever_t *lever, const uint8_t state[LEVER_STATE_BYTES]);

/* Sends SNAPSHOT beside the estimates: each period the state after a sample, spread over the time until the next, and
 * its digest. A replay of such a log may begin anywhere, and proves itself equal to the bit at each snapshot
 * (host_tools/lever_cdkf/replay). All memory is the caller's; cost: firmware/can/README.md.
 *
 *     lever_recorder_t recorder;
 *     lever_recorder_init(&recorder, 500000);
 *     ...                                           // after lever_step() and all of lever_next_frame():
 *     lever_recorder_step(&recorder, lever);
 *     while (lever_recorder_next_frame(&recorder, &tx)) { transmit(&tx); }
 *
 * What reaches an instance other than by frames (lever_idle(), lever_platform(), lever_command()) is not in a log, and
 * a replay differs until the next snapshot where it matters. */
typedef struct lever_recorder {
    uint8_t state[LEVER_STATE_BYTES];
    uint8_t counter;     /* E2E */
    uint16_t sent;       /* frames of this snapshot */
    uint16_t layout;     /* lever_state_layout() */
    uint32_t period_us;  /* from snapshot to snapshot */
    uint32_t time_us;    /* of the last sample */
    uint32_t elapsed_us; /* since the snapshot was taken */
    uint32_t taken_us;   /* when that was */
    uint32_t crc;        /* of what was sent of it */
} lever_recorder_t;

/* `period_us` of sample time from one snapshot to the next, some 350 frames each (on 1 Mbit/s classic CAN 4 % of the
 * bus at a second, 8 % at half a second). */
void lever_recorder_init(lever_recorder_t *recorder, uint32_t period_us);

/* After a step whose frames have all been fetched, before the next frame is received. */
void lever_recorder_step(lever_recorder_t *recorder, const lever_t *lever);

/* The next frame of a snapshot to send now; false when there is none left. */
bool lever_recorder_next_frame(lever_recorder_t *recorder, lever_frame_t *frame);

#ifdef __cplusplus
}
#endif

#endif
