/* A serial line brings any bytes, as many as one likes; in between any frame is sent. */
#include "any.h"

#include "port/slcan/slcan.h"

static bool put(void *self, const char *text, uint32_t length)
{
    (void)self;
    //@ assert \valid_read(text + (0 .. length - 1));
    (void)text;
    (void)length;
    return any_bool();
}

void main(void)
{
    const slcan_sink_t sink = {NULL, put};
    const slcan_identity_t identity = {"1002", "LCDK"};
    slcan_t slcan;
    slcan_frame_t frame = {{0u, 0u, {0u}}, false, false};
    slcan_init(&slcan, &sink, &identity);
    while (any_bool()) {
        if (slcan_take(&slcan, any_byte(), &frame)) {
            //@ assert frame.frame.length <= 8;
        }
        const slcan_frame_t sent = {any_frame(), any_bool(), any_bool()};
        (void)slcan_send(&slcan, &sent, any_word());
        if (any_bool()) {
            slcan_hang_up(&slcan);
        }
    }
}
