/* A receiver with any tolerance gets any frames, as many as one likes, and cycles without one; any frame is protected. */
#include "any.h"

#include "can/e2e.h"

#include <stddef.h>

void main(void)
{
    const e2e_tolerance_t tolerance = {any_byte(), any_byte(), any_byte()};
    e2e_receiver_t receiver;
    e2e_receiver_init(&receiver, any_byte(), tolerance);
    while (any_bool()) {
        lever_frame_t frame = any_frame();
        (void)e2e_is_usable(e2e_check(&receiver, any_bool() ? &frame : NULL));
        e2e_protect(&frame, any_byte(), any_byte());
    }
}
