/* The table of verdicts, cell by cell, and that it is in order of priority. */
#include "app/verdict.h"

#include "test.h"

enum { CELLS = 7 };

/* learn, adapt, torque, correction, margin, on entry, on exit. */
static const uint8_t expected[VERDICT_COUNT][CELLS] = {[VERDICT_MOTOR_WRONG] = {0, 0, 0, 1, 1, ACTION_RESTORE, 0},
    [VERDICT_HANDS_OFF] = {0, 0, 0, 0, 0, ACTION_RESTORE, ACTION_OPEN},
    [VERDICT_SENSOR_WRONG] = {0, 0, 1, 1, 1, ACTION_RESTORE, 0},
    [VERDICT_NOISE] = {0, 0, 1, 1, 1, ACTION_RESTORE, 0},
    [VERDICT_BLIND] = {0, 0, 1, 1, 1, 0, 0},
    [VERDICT_SETTLING] = {0, 0, 1, 1, 1, 0, 0},
    [VERDICT_REST] = {0, 0, 1, 1, 1, 0, 0},
    [VERDICT_REGRIP] = {0, 0, 1, 1, 1, ACTION_INFLATE, ACTION_LEVELS},
    [VERDICT_NEW] = {1, 0, 1, 1, 1, 0, 0},
    [VERDICT_LEARNING] = {1, 1, 1, 1, 1, 0, 0}};

void setUp(void)
{
}

TEST(every_cell_is_what_is_meant)
{
    for (uint32_t i = 0u; i < (uint32_t)VERDICT_COUNT; i++) {
        const verdict_row_t *row = &verdict_rows[i];
        const uint8_t cell[CELLS] = {row->learn ? 1u : 0u, row->adapt ? 1u : 0u, row->torque ? 1u : 0u,
            row->correction ? 1u : 0u, row->margin ? 1u : 0u, row->entry, row->exit};
        TEST_ASSERT_EQUAL_UINT8_ARRAY(expected[i], cell, CELLS);
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
                           (1u << (uint32_t)EVIDENCE_FORCE) | (1u << (uint32_t)EVIDENCE_BOUND);
    TEST_ASSERT_EQUAL_UINT32((1u << (uint32_t)EVIDENCE_COUNT) - 1u, seen | shown);
    TEST_ASSERT_EQUAL_UINT32(0u, seen & shown);
}
