/* An instance: the estimator, the torque that it asks of the motor, its CAN side, and what its port reports. */
#ifndef APP_INSTANCE_H
#define APP_INSTANCE_H

#include "app/dither.h"
#include "app/estimator.h"
#include "app/link.h"
#include "app/torque_gate.h"
#include "bounce/mitigation.h"
#include "can/messages.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

enum instance_same { INSTANCE_SAME_THETA = 1, INSTANCE_SAME_Z_DDOT = 2 };

/* The watch over the loop of arm, lever and rotor, and what is done about it. */
typedef struct bounce {
    mitigation_t mitigation;
    uint8_t chosen;                   /* enum lever_mitigation */
    uint8_t state;                    /* enum lever_bounce */
    uint8_t same;                     /* of enum instance_same: what the last sample measured as the one before */
    bool mitigates;                   /* one is chosen, or still fades */
    uint32_t time_us;                 /* of the sample with which the margin was worked out */
    const lever_aircraft_t *aircraft; /* NULL: none */
    margin_t margin;
} bounce_t;

struct lever {
    estimator_t estimator;
    dither_t dither;
    torque_gate_t gate;
    torque_sample_t to_gate; /* of the last sample */
    link_t link;
    bounce_t bounce;
    lever_platform_t platform; /* the port's last report, if there was one */
    uint32_t settings_sum;     /* of the settings, as words, when they were checked */
    uint32_t settings_us;      /* time of the sample with which that was last compared */
    bool has_platform;
    bool settings_changed; /* since they were checked: their memory is faulty */
};

/* Where something mitigates: renews correction and lever damping. This and the next are called one after the other with
 * the estimator: inlined, their stack would lie beneath that of the estimator. */
__attribute__((noinline)) void instance_mitigate(lever_t *lever);

/* With an aircraft: works the margin out, once a publish_period, but at most 25 times a second. */
__attribute__((noinline)) void instance_watch(lever_t *lever);

/* Carries a command out, or says why not and changes nothing. */
enum message_result instance_command(lever_t *lever, const lever_command_t *command);

/* Of a command that is refused, carries out what ends dither or mitigation. */
void instance_end(lever_t *lever, const lever_command_t *command);

/* Bits of enum lever_fault: of the last sample, of the machine, and of the bus. */
uint32_t instance_faults(const lever_t *lever);

/* The estimate may be used, but for a value that is not finite. */
bool instance_is_estimating(const lever_t *lever);

/* Torque is not zero, or may become so. */
bool instance_is_driving(const lever_t *lever);

#endif
