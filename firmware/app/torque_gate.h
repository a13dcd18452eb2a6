/* The one way out for torque: nothing reaches a MOTOR_COMMAND but through here.
 *
 * What is asked for passes finite, amplitude (torque_limit), slew (torque_slew) and rms (torque_rms) in this order. The
 * gate is open while all of this holds:
 *   - the mode, the sample clock and the machine permit it: torque_sample_t;
 *   - a sample with a valid output came within 20 ms or three sample periods, whichever is longer;
 *   - a command was accepted within the last second (keep-alive);
 *   - it is not barred. A verdict that forbids torque, as the motor does not do what it is asked or nobody holds the
 *     lever, bars it; a command that asks for torque anew ends that, once the verdict is another.
 * Otherwise torque goes to exactly zero on a straight line within 40 ms, even if torque_slew is less than that takes.
 * Closing needs no sample: the port calls torque_gate_idle(). Opening takes dither_fade.
 *
 * Rms. The mean square of the torque with a memory of 0.25 s is held below torque_rms^2 / 1.25, by an amplitude that
 * falls with the room left: then no second holds more than torque_rms. That amplitude falls slower than torque_slew, so
 * that all limits hold at once.
 *
 * Time is that of the samples, or the port's where none came; a sample whose clock does not advance counts as 5 ms, the
 * longest that a port waits before it calls torque_gate_idle(); the torque of a step moves by what a sample period
 * allows, however long the step was. */
#ifndef APP_TORQUE_GATE_H
#define APP_TORQUE_GATE_H

#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct torque_gate {
    float limit;           /* [N m] */
    float slew;            /* [N m / us] */
    float open_step;       /* of the gain, in a sample */
    float square_most;     /* greatest mean square [N^2 m^2] */
    float sustained;       /* its root: amplitude allowed for ever [N m] */
    float amplitude_slope; /* amplitude allowed beyond that per room left [1 / (N m)] */
    uint32_t period_us;    /* of a sample */
    uint32_t silence_us;   /* longest time without a valid output, so without a sample, too */
    float torque;          /* let through [N m] */
    float gain;            /* 0 to 1, of an opening gate */
    float closing;         /* rate of a closing one [N m / us] */
    float mean_square;     /* of torque [N^2 m^2] */
    uint32_t output_left;  /* time for which the last sample with a valid output serves [us] */
    uint32_t command_left; /* the last accepted command */
    uint32_t counted;      /* time since the last sample of any kind that torque_gate_idle() has counted [us] */
    bool open;
    bool barred; /* until torque is asked for anew */
    bool asked;  /* by the last command */
} torque_gate_t;

/* A sample, to the gate. */
typedef struct torque_sample {
    uint32_t elapsed_us; /* since the last one, when the sample clock advances */
    bool advances;       /* it does */
    bool measured;       /* theta or theta_dot is valid */
    bool permitted;      /* mode RUN or FROZEN (or COAST, which `measured` ends), no fault of the machine */
    bool harmful;        /* the verdict forbids torque */
} torque_sample_t;

/* Closed. */
void torque_gate_init(torque_gate_t *gate, const lever_settings_t *settings);

/* A sample came, and with it a torque to ask of the motor [N m]: renews gate->torque. */
void torque_gate_step(torque_gate_t *gate, float asked, const torque_sample_t *sample);

/* No sample came for `elapsed_us` since the last call of this or the last sample. */
void torque_gate_idle(torque_gate_t *gate, uint32_t elapsed_us);

/* The mode or the machine does not permit torque any more: it fades from now on, without a sample. */
void torque_gate_close(torque_gate_t *gate);

/* A command was accepted. */
void torque_gate_keep_alive(torque_gate_t *gate);

/* A sample with a valid output came within 20 ms or three sample periods. */
bool torque_gate_has_output(const torque_gate_t *gate);

/* A command was accepted that `asks` for torque or does not. It asks anew where the one before did not: a sender that
 * repeats a command lifts no bar. */
void torque_gate_ask(torque_gate_t *gate, bool asks);

/* No command was accepted within the last second. */
bool torque_gate_is_abandoned(const torque_gate_t *gate);

#endif
