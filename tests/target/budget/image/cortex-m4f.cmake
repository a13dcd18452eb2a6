# Toolchain file: gcc-arm-none-eabi for a Cortex-M4F, as the STM32F405 has it. Release is -O3, as shipped.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard")
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # there is nothing yet that a program could start with
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
