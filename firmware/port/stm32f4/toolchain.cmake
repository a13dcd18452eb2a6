# Cross compilation for the Cortex-M4F of an STM32F405, with Debian's gcc-arm-none-eabi and libnewlib-arm-none-eabi.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)

find_program(LEVER_ARM_GCC arm-none-eabi-gcc)
if(NOT LEVER_ARM_GCC)
    message(FATAL_ERROR "No arm-none-eabi-gcc found: apt install gcc-arm-none-eabi libnewlib-arm-none-eabi")
endif()
set(CMAKE_C_COMPILER "${LEVER_ARM_GCC}")
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -ffunction-sections -fdata-sections")
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # a program needs the linker script of the port
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
