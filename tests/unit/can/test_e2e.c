/* The state machine of E2E Profile 2, step by step. tests/python/can compares with autosar-e2e over random sequences. */
#include "can/e2e.h"

#include "test.h"

enum { NONE = -1, DAMAGED = -2, DATA_ID = 1 };

typedef struct cycle {
    int step; /* of the counter since the last frame, or NONE, or DAMAGED */
    e2e_status_t status;
    uint8_t lost;
} cycle_t;

static void assert_cycles(e2e_tolerance_t tolerance, const cycle_t cycle[], uint32_t count)
{
    lever_frame_t frame = {.length = 8u};
    e2e_receiver_t receiver;
    uint32_t counter = 0u;
    e2e_receiver_init(&receiver, (uint8_t)DATA_ID, tolerance);
    for (uint32_t i = 0u; i < count; i++) {
        counter += (cycle[i].step > 0) ? (uint32_t)cycle[i].step : 0u;
        e2e_protect(&frame, (uint8_t)DATA_ID, (uint8_t)(counter & 15u));
        frame.data[0] ^= (cycle[i].step == DAMAGED) ? 1u : 0u;
        TEST_ASSERT_EQUAL_HEX_MESSAGE(
            cycle[i].status, e2e_check(&receiver, (cycle[i].step == NONE) ? NULL : &frame), "status");
        TEST_ASSERT_EQUAL_UINT8(cycle[i].lost, receiver.lost);
    }
}

#define ASSERT_CYCLES(tolerance, cycles) assert_cycles((tolerance), (cycles), sizeof(cycles) / sizeof((cycles)[0]))

static const e2e_tolerance_t strict = {.max_delta_counter = 1u, .max_no_new_or_repeated = 1u, .sync_counter = 2u};

/* R17 */
TEST(frames_are_used_again_once_so_many_have_come_in_order)
{
    static const cycle_t cycles[] = {{1, E2E_INITIAL, 0u}, {1, E2E_OK, 0u}, {0, E2E_REPEATED, 0u}, {1, E2E_OK, 0u},
        {2, E2E_SOME_LOST, 1u}, {DAMAGED, E2E_CRC_ERROR, 0u}, {3, E2E_SOME_LOST, 2u}, /* */
        {NONE, E2E_NO_NEW_DATA, 0u}, {0, E2E_REPEATED, 0u}, {2, E2E_SYNC, 1u}, {1, E2E_SYNC, 0u}, {1, E2E_SYNC, 0u},
        {1, E2E_OK, 0u}, /* */
        {NONE, E2E_NO_NEW_DATA, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {5, E2E_WRONG_SEQUENCE, 0u}, {1, E2E_SYNC, 0u},
        {1, E2E_SYNC, 0u}, {1, E2E_OK, 0u}};
    ASSERT_CYCLES(strict, cycles);
}

/* R17 */
TEST(without_synchronisation_a_sequence_goes_on_where_it_was)
{
    static const cycle_t cycles[] = {{1, E2E_INITIAL, 0u}, {1, E2E_OK, 0u}, {3, E2E_WRONG_SEQUENCE, 0u},
        {NONE, E2E_NO_NEW_DATA, 0u}, {14, E2E_OK, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {1, E2E_OK, 0u}};
    e2e_tolerance_t lenient = strict;
    lenient.sync_counter = 0u;
    ASSERT_CYCLES(lenient, cycles);
}

/* R17 */
TEST(a_silence_of_any_length_is_tolerated_by_the_greatest_tolerance)
{
    cycle_t cycles[22] = {{1, E2E_INITIAL, 0u}};
    for (uint32_t i = 1u; i < 21u; i++) {
        cycles[i] = (cycle_t){NONE, E2E_NO_NEW_DATA, 0u};
    }
    cycles[21] = (cycle_t){1, E2E_OK, 0u};
    e2e_tolerance_t patient = strict;
    patient.max_no_new_or_repeated = 15u;
    ASSERT_CYCLES(patient, cycles);
}
