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

/* The watch over the loop of arm, lever and rotor, and what is done about it. */
typedef struct bounce {
    mitigation_t mitigation;
    const lever_aircraft_t *aircraft; /* NULL: none */
    margin_t margin;
    uint32_t time_us; /* of the sample with which that was worked out */
    uint8_t state;    /* enum lever_bounce */
} bounce_t;

struct lever {
    estimator_t estimator;
    dither_t dither;
    torque_gate_t gate;
    link_t link;
    bounce_t bounce;
    lever_platform_t platform; /* the port's last report, if there was one */
    bool has_platform;
};

/* One sample, by struct or from the bus. */
enum lever_mode instance_update(lever_t *lever, const lever_sample_t *sample);

/* After it, with an aircraft: works the margin out, once a publish_period, but at most 25 times a second. By itself, so that its stack is not beneath the estimator's. */
void instance_watch(lever_t *lever);

/* Carries a command out, or says why not and changes nothing. */
enum message_result instance_command(lever_t *lever, const lever_command_t *command);

/* Bits of enum lever_fault: of the last sample, of the machine, and of the bus. */
uint32_t instance_faults(const lever_t *lever);

/* Torque is not zero, or may become so. */
bool instance_is_driving(const lever_t *lever);

/* A mitigation is chosen, or still fades. */
bool instance_is_mitigating(const lever_t *lever);

#endif
