/* CAN bit timing at 1 Mbit/s from the clock of CAN1, at compile time: RM0090 32.7.7.
 *
 * A bit is a synchronisation quantum, segment 1 of 1 to 16 quanta, at the end of which it is sampled, and segment 2 of
 * 1 to 8. The prescaler is the least that leaves at most 25 quanta, segment 2 a quarter of them, so that the sample
 * point is at 75 % or just after: what CiA 301 asks at 1 Mbit/s. The jump width is as large as may be (at most 4, at
 * most segment 2).
 */
#ifndef LEVER_PORT_STM32F4_BIT_TIMING_H
#define LEVER_PORT_STM32F4_BIT_TIMING_H

#define BIT_TIMING_RATE 1000000 /* [bit/s] */

#define BIT_TIMING_PRESCALER(clock_hz) ((((clock_hz) / BIT_TIMING_RATE) + 24) / 25)
#define BIT_TIMING_QUANTA(clock_hz) ((clock_hz) / BIT_TIMING_RATE / BIT_TIMING_PRESCALER(clock_hz))
#define BIT_TIMING_SEGMENT_2(clock_hz) (BIT_TIMING_QUANTA(clock_hz) / 4)
#define BIT_TIMING_SEGMENT_1(clock_hz) (BIT_TIMING_QUANTA(clock_hz) - 1 - BIT_TIMING_SEGMENT_2(clock_hz))
#define BIT_TIMING_JUMP(clock_hz) ((BIT_TIMING_SEGMENT_2(clock_hz) < 4) ? BIT_TIMING_SEGMENT_2(clock_hz) : 4)

/* Where a bit is sampled, in thousandths of it. */
#define BIT_TIMING_SAMPLE_POINT(clock_hz) ((1000 * (1 + BIT_TIMING_SEGMENT_1(clock_hz))) / BIT_TIMING_QUANTA(clock_hz))

/* Whether the clock gives exactly the rate, with what the hardware has, sampled between 75 and 80 %. For #if. */
#define BIT_TIMING_IS_GOOD(clock_hz)                                                                                   \
    (((BIT_TIMING_PRESCALER(clock_hz) * BIT_TIMING_QUANTA(clock_hz) * BIT_TIMING_RATE) == (clock_hz)) &&               \
        (BIT_TIMING_PRESCALER(clock_hz) <= 1024) && (BIT_TIMING_SEGMENT_1(clock_hz) <= 16) &&                          \
        (BIT_TIMING_SEGMENT_2(clock_hz) >= 2) && (BIT_TIMING_SEGMENT_2(clock_hz) <= 8) &&                              \
        (BIT_TIMING_SAMPLE_POINT(clock_hz) >= 750) && (BIT_TIMING_SAMPLE_POINT(clock_hz) <= 800))

/* The register CAN_BTR (RM0090 32.9.2), where each value stands less one. */
#define BIT_TIMING_BTR(clock_hz)                                                                                       \
    (((uint32_t)(BIT_TIMING_JUMP(clock_hz) - 1) << 24) | ((uint32_t)(BIT_TIMING_SEGMENT_2(clock_hz) - 1) << 20) |      \
        ((uint32_t)(BIT_TIMING_SEGMENT_1(clock_hz) - 1) << 16) | (uint32_t)(BIT_TIMING_PRESCALER(clock_hz) - 1))

#endif
