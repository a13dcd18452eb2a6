/* Hard faults: recorded in memory that survives the reset which follows. */
#ifndef LEVER_PORT_STM32F4_FAULT_H
#define LEVER_PORT_STM32F4_FAULT_H

#include <stdbool.h>
#include <stdint.h>

/* What is known of a fault, for whoever looks with a debugger (symbol fault_last). PM0214 2.3.7 and 4.4. */
typedef struct fault_record {
    uint32_t mark;  /* FAULT_MARK: not yet reported; FAULT_SEEN: reported; all else: there was none since power-on */
    uint32_t count; /* faults since power-on */
    uint32_t pc;    /* the instruction; 0, like lr and psr, when the stack was lost */
    uint32_t lr;
    uint32_t psr;
    uint32_t cfsr;    /* which fault, of usage, bus and memory */
    uint32_t hfsr;    /* that it has become a hard one */
    uint32_t address; /* of the data, when cfsr says it is valid */
} fault_record_t;

#define FAULT_MARK 0xFA017EDDu
#define FAULT_SEEN 0x5EE4FA17u

extern fault_record_t fault_last;

/* Whether the last reset was that of a hard fault; from then on it is reported. */
bool fault_has_reset(void);

/* Whether the stack was not in memory at the last one: it had grown too far. */
bool fault_lost_stack(void);

/* Interrupt: records and resets. */
void fault_interrupt(void);

#endif
