#include "port/recording.h"

#include <stddef.h>

static void send_snapshot(recording_t *recording)
{
    const port_t *machine = recording->machine;
    bool has_room = true;

    lever_recorder_step(&recording->recorder, recording->lever);
    while (has_room && (recording->is_held || lever_recorder_next_frame(&recording->recorder, &recording->frame))) {
        has_room = machine->send(machine->self, &recording->frame) == PORT_DONE;
        recording->is_held = !has_room;
    }
}

static recording_t *recording_of(void *self)
{
    recording_t *recording = self; /* cppcheck-suppress misra-c2012-11.5 ; D11 */

    return recording;
}

static enum port_result receive(void *self, lever_frame_t *frame)
{
    recording_t *recording = recording_of(self);

    send_snapshot(recording);
    return recording->machine->receive(recording->machine->self, frame);
}

static enum port_result send(void *self, const lever_frame_t *frame)
{
    const port_t *machine = recording_of(self)->machine;

    return machine->send(machine->self, frame);
}

static bool wait(void *self, bool for_frame, int32_t timeout_ms)
{
    const port_t *machine = recording_of(self)->machine;

    return machine->wait(machine->self, for_frame, timeout_ms);
}

static uint32_t now_us(void *self)
{
    const port_t *machine = recording_of(self)->machine;

    return machine->now_us(machine->self);
}

static void status(void *self, lever_platform_t *report)
{
    const port_t *machine = recording_of(self)->machine;

    machine->status(machine->self, report);
}

static enum port_result restore(void *self)
{
    const port_t *machine = recording_of(self)->machine;

    return machine->restore(machine->self);
}

port_t recording_port(recording_t *recording, const port_t *machine, const lever_t *lever, uint32_t period_us)
{
    recording->machine = machine;
    recording->lever = lever;
    recording->is_held = false;
    lever_recorder_init(&recording->recorder, period_us);
    return (port_t){.self = recording,
        .receive = receive,
        .send = send,
        .wait = wait,
        .now_us = now_us,
        .status = (machine->status != NULL) ? status : NULL,
        .restore = (machine->restore != NULL) ? restore : NULL};
}
