/* An instance: the estimator, the torque that it asks of the motor, its CAN side, and what its port reports. */
#ifndef APP_INSTANCE_H
#define APP_INSTANCE_H

#include "app/bounce.h"
#include "app/dither.h"
#include "app/estimator.h"
#include "app/link_types.h"
#include "app/torque_gate.h"
#include "can/messages.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

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

/* Starts from a checked configuration, whose settings are used as long as the instance is. */
void instance_init(lever_t *lever, const lever_config_t *config);

/* The functions of lever_cdkf.h of the same names. */
enum lever_mode instance_update(lever_t *lever, const lever_sample_t *sample);
void instance_platform(lever_t *lever, const lever_platform_t *platform);

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
