#include "port/embedded/loop.h"

#include "port/embedded/port.h"

void embedded_turn(lever_t *lever)
{
    lever_frame_t frame;
    lever_platform_t status;

    port_idle();
    if (port_receive(&frame) && (lever_on_frame(lever, &frame) == LEVER_FRAME_SAMPLE)) {
        port_status(&status);
        lever_platform(lever, &status);
        (void)lever_step(lever);
        while (lever_next_frame(lever, &frame)) {
            port_send(&frame);
        }
    }
}
