/* The table of verdicts, cell by cell, and that it is in order of priority. */
#include "app/verdict.h"
#include "lever_cdkf.h"

#include "test.h"

/* The faults that forbid an action. */
#define NEVER UINT32_MAX
#define ALWAYS 0u
#define RUNNING ((uint32_t)LEVER_FAULT_CLOCK | (uint32_t)LEVER_FAULT_RECOVERED)
#define SOUND (RUNNING | (uint32_t)LEVER_FAULT_THETA | (uint32_t)LEVER_FAULT_BASE | (uint32_t)LEVER_FAULT_BOUND)

static const verdict_row_t expected[VERDICT_COUNT] = {
    /* evidence (tested below), torque, correction, margin, learn, adapt, on entry, on exit */
    [VERDICT_MOTOR_WRONG] = {0u, NEVER, RUNNING, SOUND, false, false, ACTION_RESTORE, 0u},
    [VERDICT_HANDS_OFF] = {0u, NEVER, NEVER, NEVER, false, false, ACTION_RESTORE, ACTION_OPEN},
    [VERDICT_SENSOR_WRONG] = {0u, ALWAYS, RUNNING, SOUND, false, false, ACTION_RESTORE, 0u},
    [VERDICT_STICKING] = {0u, ALWAYS, RUNNING, SOUND, false, false, ACTION_OPEN, 0u},
    [VERDICT_NOISE] = {0u, ALWAYS, RUNNING, SOUND, false, false, ACTION_RESTORE, ACTION_INFLATE},
    [VERDICT_BLIND] = {0u, ALWAYS, RUNNING, SOUND, false, false, 0u, 0u},
    [VERDICT_SETTLING] = {0u, ALWAYS, RUNNING, SOUND, false, false, 0u, 0u},
    [VERDICT_REST] = {0u, ALWAYS, RUNNING, SOUND, false, false, 0u, 0u},
    [VERDICT_UNEXPLAINED] = {0u, ALWAYS, RUNNING, SOUND, true, true, ACTION_OPEN, 0u},
    [VERDICT_REGRIP] = {0u, ALWAYS, RUNNING, SOUND, false, false, ACTION_INFLATE, ACTION_LEVELS},
    [VERDICT_NEW] = {0u, ALWAYS, RUNNING, SOUND, true, false, 0u, 0u},
    [VERDICT_LEARNING] = {0u, ALWAYS, RUNNING, SOUND, true, true, 0u, 0u}};

void setUp(void)
{
}

/* With each fault by itself, and with none: `forbidding` is expected. */
static void check_action(uint32_t forbidding, uint32_t cell)
{
    TEST_ASSERT_EQUAL(forbidding != NEVER, verdict_permits(cell, 0u));
    for (uint32_t fault = 1u; fault <= (uint32_t)LEVER_FAULT_HANDS_OFF; fault <<= 1u) {
        TEST_ASSERT_EQUAL((forbidding & fault) == 0u, verdict_permits(cell, fault));
    }
}

TEST(every_cell_is_what_is_meant)
{
    for (uint32_t i = 0u; i < (uint32_t)VERDICT_COUNT; i++) {
        const verdict_row_t *row = &verdict_rows[i];
        TEST_ASSERT_EQUAL(expected[i].learn, row->learn);
        TEST_ASSERT_EQUAL(expected[i].adapt, row->adapt);
        check_action(expected[i].torque, row->torque);
        check_action(expected[i].correction, row->correction);
        check_action(expected[i].margin, row->margin);
        TEST_ASSERT_EQUAL_UINT8(expected[i].entry, row->entry);
        TEST_ASSERT_EQUAL_UINT8(expected[i].exit, row->exit);
    }
}

/* A motor that may do the reverse does harm only where it answers the motion. */
/* R37 */
TEST(damping_is_forbidden_where_torque_is_and_while_no_arm_explains_the_motion)
{
    for (uint32_t i = 0u; i < (uint32_t)VERDICT_COUNT; i++) {
        const bool forbidden = (expected[i].torque == NEVER) || (i == (uint32_t)VERDICT_UNEXPLAINED);
        TEST_ASSERT_EQUAL(!forbidden, verdict_permits(verdict_rows[i].torque, VERDICT_DAMPING));
    }
}

/* Of two verdicts whose evidence is present the first stands; without any the parameters learn. */
TEST(the_first_verdict_whose_evidence_is_present_stands)
{
    TEST_ASSERT_EQUAL(VERDICT_LEARNING, verdict_of(0u));
    for (uint32_t i = 0u; i < (uint32_t)VERDICT_LEARNING; i++) {
        for (uint32_t j = i; j < (uint32_t)VERDICT_LEARNING; j++) {
            TEST_ASSERT_EQUAL(i, verdict_of(verdict_rows[i].evidence | verdict_rows[j].evidence));
        }
    }
}

/* Evidence of the model, not of the samples, makes no verdict: it is shown. */
TEST(each_item_of_evidence_makes_one_verdict_at_most)
{
    uint32_t seen = 0u;
    for (uint32_t i = 0u; i < (uint32_t)VERDICT_COUNT; i++) {
        TEST_ASSERT_EQUAL_UINT32(0u, seen & verdict_rows[i].evidence);
        seen |= verdict_rows[i].evidence;
    }
    const uint32_t shown = (1u << (uint32_t)EVIDENCE_CHANGE) | (1u << (uint32_t)EVIDENCE_INNOVATION) |
                           (1u << (uint32_t)EVIDENCE_COLOUR) | (1u << (uint32_t)EVIDENCE_CALIBRATION) |
                           (1u << (uint32_t)EVIDENCE_FORCE) | (1u << (uint32_t)EVIDENCE_TORQUE_GAIN) |
                           (1u << (uint32_t)EVIDENCE_CLOCK) | (1u << (uint32_t)EVIDENCE_OFFSET) |
                           (1u << (uint32_t)EVIDENCE_BOUND);
    TEST_ASSERT_EQUAL_UINT32((1u << (uint32_t)EVIDENCE_COUNT) - 1u, seen | shown);
    TEST_ASSERT_EQUAL_UINT32(0u, seen & shown);
}
