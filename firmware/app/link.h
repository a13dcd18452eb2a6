/* The CAN side of an instance: received frames become samples and commands, estimates become frames to send. */
#ifndef APP_LINK_H
#define APP_LINK_H

#include "app/instance.h"

#include <stdbool.h>
#include <stdint.h>

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
