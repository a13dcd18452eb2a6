/* The registers that this port uses, after RM0090 (reference manual of the STM32F405) and PM0214 (Cortex-M4 programming
 * manual).
 *
 * Each peripheral is an object that registers.ld puts at its address, so that no code makes pointers out of numbers,
 * and a test on the host can put ordinary memory there. Names are the manuals'; sections stand beside each struct.
 */
#ifndef LEVER_PORT_STM32F4_REGISTERS_H
#define LEVER_PORT_STM32F4_REGISTERS_H

#include <stdint.h>

/* Bit n, and a field of a register: a value at its lowest bit. */
#define BIT(n) ((uint32_t)1u << (n))
#define FIELD(value, lowest) ((uint32_t)(value) << (lowest))

typedef volatile uint32_t reg_t;

/* RCC, reset and clock control: RM0090 7.3 */
typedef struct rcc {
    reg_t CR;         /* 7.3.1 */
    reg_t PLLCFGR;    /* 7.3.2 */
    reg_t CFGR;       /* 7.3.3 */
    reg_t CIR;        /* 7.3.4 */
    reg_t AHBRSTR[4]; /* 7.3.5 to 7.3.7, one reserved */
    reg_t APB1RSTR;   /* 7.3.8 */
    reg_t APB2RSTR;   /* 7.3.9 */
    reg_t reserved_1[2];
    reg_t AHB1ENR; /* 7.3.10 */
    reg_t AHB2ENR; /* 7.3.11 */
    reg_t AHB3ENR; /* 7.3.12 */
    reg_t reserved_2;
    reg_t APB1ENR;       /* 7.3.13 */
    reg_t APB2ENR;       /* 7.3.14 */
    reg_t reserved_3[2]; /* then the same for sleep: the reset values keep everything on */
    reg_t LPENR[6];      /* 7.3.15 to 7.3.19, one reserved */
    reg_t reserved_4[2];
    reg_t BDCR; /* 7.3.20 */
    reg_t CSR;  /* 7.3.21 */
} rcc_t;

#define RCC_CR_HSEON BIT(16u)
#define RCC_CR_HSERDY BIT(17u)
#define RCC_CR_CSSON BIT(19u)
#define RCC_CR_PLLON BIT(24u)
#define RCC_CR_PLLRDY BIT(25u)
#define RCC_PLLCFGR_PLLSRC_HSE BIT(22u)
#define RCC_CFGR_SW_PLL 2u                 /* SW, bits 1:0 */
#define RCC_CFGR_SWS FIELD(3u, 2u)         /* field */
#define RCC_CFGR_SWS_PLL FIELD(2u, 2u)     /* its value */
#define RCC_CFGR_PPRE1_DIV4 FIELD(5u, 10u) /* PPRE1, bits 12:10 */
#define RCC_CFGR_PPRE2_DIV2 FIELD(4u, 13u) /* PPRE2, bits 15:13 */
#define RCC_CIR_CSSC BIT(23u)
#define RCC_AHB1_GPIOA BIT(0u)
#define RCC_AHB1_GPIOB BIT(1u)
#define RCC_APB1_CAN1 BIT(25u)
#define RCC_APB1_PWR BIT(28u)
#define RCC_APB2_USART1 BIT(4u)
#define RCC_CSR_RMVF BIT(24u)
#define RCC_CSR_BORRSTF BIT(25u)
#define RCC_CSR_PINRSTF BIT(26u)
#define RCC_CSR_PORRSTF BIT(27u)
#define RCC_CSR_SFTRSTF BIT(28u)
#define RCC_CSR_IWDGRSTF BIT(29u)

/* PWR, power control: RM0090 5.4 */
typedef struct pwr {
    reg_t CR; /* 5.4.1 */
    reg_t CSR;
} pwr_t;

#define PWR_CR_VOS BIT(14u)

/* FLASH interface: RM0090 3.9.1 */
typedef struct flash {
    reg_t ACR;
} flash_t;

#define FLASH_ACR_LATENCY 7u /* field */
#define FLASH_ACR_PRFTEN BIT(8u)
#define FLASH_ACR_ICEN BIT(9u)
#define FLASH_ACR_DCEN BIT(10u)

/* GPIO port: RM0090 8.4 */
typedef struct gpio {
    reg_t MODER;   /* 8.4.1: two bits a pin, 2: alternate function */
    reg_t OTYPER;  /* 8.4.2 */
    reg_t OSPEEDR; /* 8.4.3: two bits a pin, 2: high speed */
    reg_t PUPDR;   /* 8.4.4: two bits a pin, 1: pull-up */
    reg_t IDR;
    reg_t ODR;
    reg_t BSRR;
    reg_t LCKR;
    reg_t AFR[2]; /* 8.4.9, 8.4.10: four bits a pin */
} gpio_t;

/* USART: RM0090 30.6 */
typedef struct usart {
    reg_t SR;  /* 30.6.1 */
    reg_t DR;  /* 30.6.2 */
    reg_t BRR; /* 30.6.3 */
    reg_t CR1; /* 30.6.4 */
    reg_t CR2;
    reg_t CR3;
    reg_t GTPR;
} usart_t;

#define USART_SR_ORE BIT(3u)
#define USART_SR_RXNE BIT(5u)
#define USART_SR_TXE BIT(7u)
#define USART_CR1_RE BIT(2u)
#define USART_CR1_TE BIT(3u)
#define USART_CR1_RXNEIE BIT(5u)
#define USART_CR1_TXEIE BIT(7u)
#define USART_CR1_UE BIT(13u)

/* bxCAN: RM0090 32.9; a mailbox, of either direction: 32.9.3 */
typedef struct can_mailbox {
    reg_t IR;
    reg_t DTR;
    reg_t DLR;
    reg_t DHR;
} can_mailbox_t;

enum can_limits { CAN_MAILBOXES = 3, CAN_FIFOS = 2, CAN_BANKS = 28, CAN_RESERVED_1 = 88, CAN_RESERVED_2 = 12 };

typedef struct can {
    reg_t MCR; /* 32.9.2, to BTR */
    reg_t MSR;
    reg_t TSR;
    reg_t RFR[CAN_FIFOS];
    reg_t IER;
    reg_t ESR;
    reg_t BTR;
    reg_t reserved_1[CAN_RESERVED_1];
    can_mailbox_t transmit[CAN_MAILBOXES];
    can_mailbox_t receive[CAN_FIFOS];
    reg_t reserved_2[CAN_RESERVED_2];
    reg_t FMR; /* 32.9.4, to the end */
    reg_t FM1R;
    reg_t reserved_3;
    reg_t FS1R;
    reg_t reserved_4;
    reg_t FFA1R;
    reg_t reserved_5;
    reg_t FA1R;
    reg_t reserved_6[8];
    reg_t FR[CAN_BANKS][2];
} can_t;

#define CAN_MCR_INRQ BIT(0u)
#define CAN_MCR_SLEEP BIT(1u)
#define CAN_MCR_TXFP BIT(2u)
#define CAN_MCR_RFLM BIT(3u)
#define CAN_MCR_ABOM BIT(6u)
#define CAN_MCR_DBF BIT(16u)
#define CAN_MSR_INAK BIT(0u)
#define CAN_MSR_ERRI BIT(2u)
#define CAN_TSR_RQCP0 BIT(0u) /* this and the next of mailbox 0; mailbox m has them 8 m higher */
#define CAN_TSR_TXOK0 BIT(1u)
#define CAN_TSR_ABRQ0 BIT(7u)  /* the same */
#define CAN_TSR_ABRQ 0x808080u /* one bit for each mailbox */
#define CAN_TSR_RQCP 0x010101u /* the same */
#define CAN_TSR_CODE_LOWEST 24u
#define CAN_TSR_TME0 BIT(26u) /* of mailbox 0; the next ones follow */
#define CAN_TSR_TME FIELD(7u, 26u)
#define CAN_RFR_FMP 3u /* field */
#define CAN_RFR_FOVR BIT(4u)
#define CAN_RFR_RFOM BIT(5u)
#define CAN_IER_TMEIE BIT(0u)
#define CAN_IER_FMPIE0 BIT(1u)
#define CAN_IER_FOVIE0 BIT(3u)
#define CAN_IER_BOFIE BIT(10u)
#define CAN_IER_ERRIE BIT(15u)
#define CAN_ESR_BOFF BIT(2u)
#define CAN_ESR_TEC_LOWEST 16u
#define CAN_ESR_REC_LOWEST 24u
#define CAN_IR_TXRQ BIT(0u)
#define CAN_IR_RTR BIT(1u)
#define CAN_IR_IDE BIT(2u)
#define CAN_IR_EXID_LOWEST 3u
#define CAN_IR_STID_LOWEST 21u
#define CAN_DTR_DLC 15u /* field */
#define CAN_FMR_FINIT BIT(0u)

/* IWDG, independent watchdog: RM0090 21.4 */
typedef struct iwdg {
    reg_t KR;  /* 21.4.1 */
    reg_t PR;  /* 21.4.2 */
    reg_t RLR; /* 21.4.3 */
    reg_t SR;  /* 21.4.4 */
} iwdg_t;

enum iwdg_keys { IWDG_KR_RELOAD = 0xAAAA, IWDG_KR_UNLOCK = 0x5555, IWDG_KR_START = 0xCCCC };

/* DBGMCU, debug support: RM0090 38.16 */
typedef struct dbgmcu {
    reg_t IDCODE;
    reg_t CR;
    reg_t APB1_FZ; /* 38.16.4 */
} dbgmcu_t;

#define DBGMCU_APB1_FZ_IWDG BIT(12u)

/* SysTick: PM0214 4.5 */
typedef struct systick {
    reg_t CTRL;
    reg_t LOAD;
    reg_t VAL;
    reg_t CALIB;
} systick_t;

#define SYSTICK_CTRL_ENABLE BIT(0u)
#define SYSTICK_CTRL_TICKINT BIT(1u)
#define SYSTICK_CTRL_CLKSOURCE BIT(2u)

/* NVIC, interrupt set-enable: PM0214 4.3.2; positions: RM0090 12.2 (table 62) */
typedef struct nvic {
    reg_t ISER[8];
} nvic_t;

#define INTERRUPT_CAN1_TX 19u
#define INTERRUPT_CAN1_RX0 20u
#define INTERRUPT_CAN1_SCE 22u
#define INTERRUPT_USART1 37u

/* SCB, system control block: PM0214 4.4 */
typedef struct scb {
    reg_t CPUID;
    reg_t ICSR;
    reg_t VTOR;
    reg_t AIRCR; /* 4.4.5 */
    reg_t SCR;
    reg_t CCR;
    reg_t SHPR[3];
    reg_t SHCSR;
    reg_t CFSR; /* 4.4.10 to 4.4.13 */
    reg_t HFSR; /* 4.4.14 */
    reg_t DFSR;
    reg_t MMFAR; /* 4.4.15 */
    reg_t BFAR;  /* 4.4.16 */
    reg_t AFSR;
    reg_t ID[16];
    reg_t reserved[2];
    reg_t CPACR; /* 4.6.1: bits 23:20 give access to the FPU */
} scb_t;

#define SCB_AIRCR_RESET 0x05FA0004u   /* VECTKEY and SYSRESETREQ */
#define SCB_CPACR_FPU FIELD(0xFu, 20) /* CP10 and CP11: full access */

extern rcc_t rcc;
extern pwr_t pwr;
extern flash_t flash;
extern gpio_t gpioa;
extern gpio_t gpiob;
extern usart_t usart1;
extern can_t can1;
extern iwdg_t iwdg;
extern dbgmcu_t dbgmcu;
extern systick_t systick;
extern nvic_t nvic;
extern scb_t scb;

#endif
